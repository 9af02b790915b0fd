#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "gamer/core/cancellation.h"
#include "studio/message.h"
#include "studio/page.h"
#include "studio/task_queue.h"
#include "studio/view.h"

namespace gamer {

/// Renders the views of all pages in a thread of its own. Of a page only the newest view counts: it
/// cancels the one before. A view that was cancelled ends with the message "cancelled".
class ViewQueue {
 public:
  /// Renders a view: sends its frames but the last, which it returns.
  using Render = std::function<std::string(std::int64_t id, const ViewRequest& request,
                                           const Cancellation& cancellation, const Send& send)>;
  explicit ViewQueue(Render render) : render_(std::move(render)) {}
  /// Cancels all views.
  ~ViewQueue();

  void ask(const std::shared_ptr<Page>& page, std::int64_t id, ViewRequest request);
  /// Cancels the view of a page, and tells whether it had one.
  bool cancel(const Page& page);

 private:
  struct View {
    View(const std::shared_ptr<Page>& asker, std::int64_t number, ViewRequest wanted)
        : page(asker), key(asker.get()), id(number), request(std::move(wanted)) {}

    std::weak_ptr<Page> page;
    const Page* key;
    std::int64_t id;
    ViewRequest request;
    Cancellation cancellation;
  };
  void render(const std::shared_ptr<View>& view);
  void return_memory();

  Render render_;
  std::mutex mutex_;
  std::list<std::shared_ptr<View>> views_;  ///< in progress or waiting
  std::chrono::steady_clock::time_point returned_ = {};
  TaskQueue queue_;  ///< its thread ends before the rest
};

}  // namespace gamer
