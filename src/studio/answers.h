#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "gamer/job/session.h"
#include "studio/document.h"
#include "studio/known_paths.h"
#include "studio/message.h"
#include "studio/output_folder.h"

namespace gamer {

/// Answers messages that need no render, one at a time. It remembers the contents of the document's
/// files, so that it never overwrites a file that another program has changed.
class Answers {
 public:
  Answers(const Session& session, OpenedDocument document);

  /// All of these throw InputError and RunError.
  nlohmann::json operator()(const OpenRequest& request) const;
  nlohmann::json operator()(const EditRequest& request);
  nlohmann::json operator()(const EditSceneRequest& request) const;
  nlohmann::json operator()(const FixOrientationsRequest& request) const;
  nlohmann::json operator()(const GalaxyRequest& request);
  nlohmann::json operator()(const ModelRequest& request);
  nlohmann::json operator()(const SaveRequest& request);
  nlohmann::json operator()(const SaveSceneRequest& request);
  nlohmann::json operator()(const CommandRequest& request) const;
  nlohmann::json operator()(const OutputsRequest& request) const;

  /// Writes those texts of the document that are in no file beside the output, and returns the
  /// command line.
  std::vector<std::string> prepare(const RenderRequest& request) const;

  const OpenedDocument& document() const { return document_; }
  const KnownPaths& paths() const { return paths_; }

 private:
  void save_over(const std::filesystem::path& file, std::string& known, const std::string& text,
                 bool overwrite) const;
  nlohmann::json save_own(const SaveRequest& request);
  nlohmann::json save_as(const SaveRequest& request) const;
  std::string path_of_output(const std::string& name) const;

  const Session& session_;
  OpenedDocument document_;
  KnownPaths paths_;
  OutputFolder folder_;
  std::shared_ptr<const Galaxy> latest_;  ///< the galaxy whose model was asked for last, or null
  std::string galaxy_label_;              ///< a galaxy's text names files relative to this file
};

}  // namespace gamer
