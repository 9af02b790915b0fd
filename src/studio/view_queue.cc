#include "studio/view_queue.h"

#include <malloc.h>

#include <exception>
#include <new>

namespace gamer {

ViewQueue::~ViewQueue() {
  const std::lock_guard lock(mutex_);
  for (const auto& view : views_) view->cancellation.request();
}

bool ViewQueue::cancel(const Page& page) {
  const std::lock_guard lock(mutex_);
  bool was_there = false;
  for (const auto& view : views_) {
    if (view->key != &page) continue;
    view->cancellation.request();
    was_there = true;
  }
  return was_there;
}

void ViewQueue::ask(const std::shared_ptr<Page>& page, std::int64_t id, ViewRequest request) {
  {
    const std::lock_guard lock(mutex_);
    for (const auto& view : views_) {
      if (view->key == page.get() || view->is_draft) view->cancellation.request();
    }
  }
  add(std::make_shared<View>(
      page, id, false,
      [this, id, request = std::move(request)](const Cancellation& cancellation, const Send& send) {
        return render_(id, request, cancellation, send);
      }));
}

void ViewQueue::ask_draft(const std::shared_ptr<Page>& page, std::int64_t id, Work work) {
  {
    const std::lock_guard lock(mutex_);
    for (const auto& view : views_) {
      if (view->key == page.get() && view->is_draft) view->cancellation.request();
    }
  }
  add(std::make_shared<View>(page, id, true, std::move(work)));
}

void ViewQueue::add(std::shared_ptr<View> view) {
  {
    const std::lock_guard lock(mutex_);
    views_.push_back(view);
  }
  queue_.add([this, view = std::move(view)] {
    render(view);
    return_memory();
  });
}

/// Gives memory that renders have freed back to the system, at most once a second. The threads of
/// each render have heaps of their own, which would keep it.
void ViewQueue::return_memory() {
  using std::chrono::steady_clock;
  const auto now = steady_clock::now();
  if (now - returned_ < std::chrono::seconds(1)) return;
  returned_ = now;
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

void ViewQueue::render(const std::shared_ptr<View>& view) {
  const auto page = view->page.lock();
  const auto send = [&](std::string message, bool is_binary) {
    if (view->cancellation.is_requested()) throw Cancelled();
    page->send(std::move(message), is_binary);
  };
  // The view leaves the list before the page learns of its end, so that later requests do not find
  // it.
  const auto leave = [&](bool unless_cancelled = false) {
    const std::lock_guard lock(mutex_);
    if (unless_cancelled && view->cancellation.is_requested()) throw Cancelled();
    views_.remove(view);
  };
  if (!page) return leave();
  try {
    if (view->cancellation.is_requested()) throw Cancelled();
    std::string last = view->work(view->cancellation, send);
    leave(true);
    page->send(std::move(last), true);
  } catch (const Cancelled&) {
    leave();
    page->reply({{"op", "cancelled"}, {"id", view->id}});
  } catch (const std::bad_alloc&) {
    leave();
    page->fail(view->id, "gstudio: out of memory");
  } catch (const std::exception& error) {
    leave();
    page->fail(view->id, error.what());
  }
}

}  // namespace gamer
