#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

namespace gamer {

/// A thread that runs tasks one after the other. The destructor waits for the running task and
/// drops the waiting tasks.
class TaskQueue {
 public:
  TaskQueue();
  ~TaskQueue();
  TaskQueue& operator=(TaskQueue&&) = delete;

  /// Adds a task, which must not throw. Any thread may call it.
  void add(std::function<void()> task);
  /// Number of waiting tasks.
  std::size_t size() const;

 private:
  void run();

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> tasks_;
  bool ends_ = false;
  std::thread thread_;
};

}  // namespace gamer
