#include <condition_variable>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "gamer/core/error.h"
#include "studio/render_queue.h"
#include "studio/view_queue.h"

namespace gamer::queues_test {
namespace {

/// A page that runs a function for each message, and waits for a number of messages.
class RecordingPage : public Page {
 public:
  explicit RecordingPage(std::function<void(const std::string&)> at_message = {})
      : at_message_(std::move(at_message)) {}

  void send(std::string message, bool) override {
    if (at_message_) at_message_(message);
    {
      const std::lock_guard lock(mutex_);
      messages_.push_back(std::move(message));
    }
    changed_.notify_all();
  }

  std::vector<std::string> wait(std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return messages_.size() >= count; });
    return messages_;
  }

 private:
  std::function<void(const std::string&)> at_message_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::string> messages_;
};

TEST(ViewQueue, AViewIsGoneWhenThePageHearsOfItsEnd) {
  for (const std::string end : {"frame", "error", "cancelled"}) {
    ViewQueue* queue = nullptr;
    std::vector<bool> was_there;
    std::shared_ptr<RecordingPage> page;
    page = std::make_shared<RecordingPage>(
        [&](const std::string&) { was_there.push_back(queue->cancel(*page)); });
    ViewQueue views([&](std::int64_t, const ViewRequest&, const Cancellation& cancellation,
                        const Send&) -> std::string {
      if (end == "error") throw std::runtime_error("broken");
      if (end == "cancelled") queue->cancel(*page);
      EXPECT_EQ(cancellation.is_requested(), end == "cancelled");
      return "last frame";
    });
    queue = &views;
    views.ask(page, 7, {});
    const std::string message = page->wait(1).front();
    EXPECT_EQ(was_there, std::vector<bool>{false}) << end;
    EXPECT_NE(message.find(end), std::string::npos) << message;
  }
}

TEST(ViewQueue, AViewEndsTheDraftsOfAllPages) {
  const auto drafting = std::make_shared<RecordingPage>(),
             viewing = std::make_shared<RecordingPage>();
  std::promise<void> begun;
  ViewQueue views([](std::int64_t, const ViewRequest&, const Cancellation&,
                     const Send&) -> std::string { return "frame"; });
  views.ask_draft(drafting, 3, [&](const Cancellation& cancellation, const Send&) -> std::string {
    begun.set_value();
    while (!cancellation.is_requested()) std::this_thread::yield();
    throw Cancelled();
  });
  begun.get_future().wait();
  views.ask(viewing, 4, {});
  EXPECT_EQ(viewing->wait(1).front(), "frame");
  EXPECT_NE(drafting->wait(1).front().find("cancelled"), std::string::npos);
}

TEST(RenderQueue, TheNameIsFreeWhenThePageHearsOfTheEnd) {
  RenderQueue* queue = nullptr;
  int left = 20;
  std::shared_ptr<RecordingPage> page;
  page = std::make_shared<RecordingPage>([&](const std::string&) {
    if (--left == 0) return;
    EXPECT_NO_THROW(queue->add({page, left, "x.fits", {"/bin/false"}}));
  });
  RenderQueue renders;
  queue = &renders;
  renders.add({page, left, "x.fits", {"/bin/false"}});
  for (const std::string& message : page->wait(20)) {
    EXPECT_NE(message.find("\"error\""), std::string::npos) << message;
  }
}

TEST(RenderQueue, ANameIsRenderedOnceAtATime) {
  const auto page = std::make_shared<RecordingPage>();
  RenderQueue renders;
  renders.add({page, 1, "x.fits", {"/bin/sleep", "100"}});
  EXPECT_THROW(renders.add({page, 2, "x.fits", {"/bin/false"}}), InputError);
}

}  // namespace
}  // namespace gamer::queues_test
