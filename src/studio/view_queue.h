#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "gamer/core/cancellation.h"
#include "studio/message.h"
#include "studio/page.h"
#include "studio/task_queue.h"
#include "studio/view.h"

namespace gamer {

/// Renders the views and drafts of all pages in a thread of its own. A new view cancels the earlier
/// view of its page. It also cancels the drafts of all pages, which are less urgent. A cancelled
/// view or draft ends with the message "cancelled".
class ViewQueue {
 public:
  /// Renders a view: sends its frames but the last, which it returns.
  using Render = std::function<std::string(std::int64_t id, const ViewRequest& request,
                                           const Cancellation& cancellation, const Send& send)>;
  /// Makes a draft: sends its parts but the last, which it returns.
  using Work = std::function<std::string(const Cancellation& cancellation, const Send& send)>;
  explicit ViewQueue(Render render) : render_(std::move(render)) {}
  /// Cancels all views.
  ~ViewQueue();

  void ask(const std::shared_ptr<Page>& page, std::int64_t id, ViewRequest request);
  /// Adds a draft. A page has at most one draft; a new one cancels the earlier.
  void ask_draft(const std::shared_ptr<Page>& page, std::int64_t id, Work work);
  /// Cancels the view and the draft of a page, and tells whether it had one.
  bool cancel(const Page& page);

 private:
  struct View {
    View(const std::shared_ptr<Page>& asker, std::int64_t number, bool draft, Work view_work)
        : page(asker), key(asker.get()), id(number), is_draft(draft), work(std::move(view_work)) {}

    std::weak_ptr<Page> page;
    const Page* key;
    std::int64_t id;
    bool is_draft;
    Work work;
    Cancellation cancellation;
  };
  void add(std::shared_ptr<View> view);
  void render(const std::shared_ptr<View>& view);
  void return_memory();

  Render render_;
  std::mutex mutex_;
  std::list<std::shared_ptr<View>> views_;  ///< in progress or waiting
  std::chrono::steady_clock::time_point returned_ = {};
  TaskQueue queue_;  ///< its thread ends before the rest
};

}  // namespace gamer
