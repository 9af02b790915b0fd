#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "gamer/job/session.h"
#include "studio/document.h"
#include "studio/message.h"
#include "studio/page.h"
#include "studio/task_queue.h"
#include "studio/view_queue.h"

namespace gamer {

/// Answers the messages of all pages. The thread of the server calls it; work is done in others.
class StudioCore {
 public:
  /// Opens what the options name. Throws InputError.
  explicit StudioCore(const StudioOptions& options);

  void receive(const std::shared_ptr<Page>& page, std::string_view text);
  const OpenedDocument& document() const { return document_; }
  /// The page has gone; its view is cancelled.
  void leave(const Page& page);

 private:
  /// The answer to a message that needs no render. Throws InputError and RunError.
  nlohmann::json answer(const Message& message) const;
  void start(const std::shared_ptr<Page>& page, Message message);

  Session session_;
  OpenedDocument document_;
  TaskQueue answers_;
  ViewQueue views_;
};

}  // namespace gamer
