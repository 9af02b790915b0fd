#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "studio/page.h"
#include "studio/task_queue.h"

namespace gamer {

/// A render that the program `gamer` does.
struct RenderTask {
  std::shared_ptr<Page> page;
  std::int64_t id = 0;
  std::string name;                ///< of the file
  std::vector<std::string> words;  ///< the command line
};

/// A queue of renders, which run one after the other. Each is a run of the program `gamer`, so that
/// its file, journal and messages are those of the program. The page gets messages on progress, and
/// at the end "rendered", "cancelled" or "error".
class RenderQueue {
 public:
  RenderQueue() = default;
  /// Stops the render in progress as a signal does; it can be resumed.
  ~RenderQueue();
  RenderQueue& operator=(RenderQueue&&) = delete;

  /// Throws InputError where too many renders wait, or one of them makes a file of this name.
  void add(RenderTask task);
  /// Cancels a page's render, and tells whether there was one.
  bool cancel(const Page& page, std::int64_t id);
  /// The renders that are not finished: name, done, total, unit.
  nlohmann::json list() const;

 private:
  struct Render {
    RenderTask task;
    bool is_cancelled = false;
    pid_t process = 0;
    int done = 0, total = 0;
    std::string unit;
    std::string error;  ///< the last one that the program told
  };
  /// Runs the program; returns the message of its end.
  nlohmann::json run(Render& render);
  void take_line(Render& render, const std::string& line);
  static void stop(Render& render);

  mutable std::mutex mutex_;
  std::list<std::shared_ptr<Render>> renders_;
  TaskQueue queue_;
};

}  // namespace gamer
