#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "gamer/job/session.h"
#include "studio/answers.h"
#include "studio/message.h"
#include "studio/page.h"
#include "studio/render_queue.h"
#include "studio/task_queue.h"
#include "studio/view_queue.h"

namespace gamer {

/// Answers the messages of all pages. The thread of the server calls it; work is done in others.
class StudioCore {
 public:
  /// Opens the files of the options. Throws InputError.
  explicit StudioCore(const StudioOptions& options);

  void receive(const std::shared_ptr<Page>& page, std::string_view text);
  const StudioOptions& options() const { return options_; }
  /// Cancels the view of a page that has gone.
  void leave(const Page& page);

 private:
  void start(const std::shared_ptr<Page>& page, Message message);
  void cancel(const std::shared_ptr<Page>& page, const CancelRequest& request);
  /// Answers in the thread of the answers. Throws InputError and RunError.
  void answer(const std::shared_ptr<Page>& page, const Message& message);
  void render(const std::shared_ptr<Page>& page, std::int64_t id, const RenderRequest& request);

  StudioOptions options_;
  Session session_;
  Answers answers_;
  std::string label_;  ///< of the document
  KnownPaths paths_;
  RenderQueue renders_;
  TaskQueue waiting_;
  ViewQueue views_;
};

}  // namespace gamer
