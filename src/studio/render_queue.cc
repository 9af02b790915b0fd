#include "studio/render_queue.h"

#include <signal.h>

#include <exception>
#include <utility>

#include "core/message.h"
#include "studio/child_process.h"

namespace gamer {
namespace {

using Json = nlohmann::json;

constexpr std::size_t most_renders = 100;

/// A member of a message of the program, or another value.
template <typename Value>
Value member(const Json& message, const char* key, Value other) {
  const auto found = message.find(key);
  try {
    return found != message.end() && !found->is_null() ? found->get<Value>() : other;
  } catch (const Json::exception&) {
    return other;
  }
}

}  // namespace

RenderQueue::~RenderQueue() {
  const std::lock_guard lock(mutex_);
  for (const auto& render : renders_) stop(*render);
}

void RenderQueue::stop(Render& render) {
  render.is_cancelled = true;
  if (render.process > 0) kill(render.process, SIGTERM);
}

void RenderQueue::add(RenderTask task) {
  const auto render = std::make_shared<Render>();
  render->task = std::move(task);
  {
    const std::lock_guard lock(mutex_);
    if (renders_.size() >= most_renders) throw InputError("too many renders wait");
    for (const auto& other : renders_) {
      if (other->task.name == render->task.name && !other->is_cancelled) {
        throw input_error("'{}' is being rendered already", render->task.name);
      }
    }
    renders_.push_back(render);
  }
  queue_.add([this, render] {
    const Json end = run(*render);
    {
      // The render is removed before the page learns of its end.
      const std::lock_guard lock(mutex_);
      renders_.remove(render);
    }
    render->task.page->reply(end);
  });
}

bool RenderQueue::cancel(const Page& page, std::int64_t id) {
  const std::lock_guard lock(mutex_);
  for (const auto& render : renders_) {
    if (render->task.page.get() != &page || render->task.id != id) continue;
    stop(*render);
    return true;
  }
  return false;
}

Json RenderQueue::list() const {
  const std::lock_guard lock(mutex_);
  Json list = Json::array();
  for (const auto& render : renders_) {
    list.push_back({{"id", render->task.id},
                    {"name", render->task.name},
                    {"done", render->done},
                    {"total", render->total},
                    {"stage", render->unit}});
  }
  return list;
}

void RenderQueue::take_line(Render& render, const std::string& line) {
  const Json message = Json::parse(line, nullptr, false);
  if (!message.is_object()) return;
  const RenderTask& task = render.task;
  const auto level = member<std::string>(message, "level", "");
  const auto text = member<std::string>(message, "text", "");
  if (level == "progress") {
    Json progress = {{"op", "progress"}, {"id", task.id}, {"name", task.name}};
    {
      const std::lock_guard lock(mutex_);
      render.done = member(message, "done", 0);
      render.total = member(message, "total", 0);
      render.unit = member<std::string>(message, "unit", "");
      progress.update({{"stage", render.unit}, {"done", render.done}, {"total", render.total}});
    }
    progress["left"] = message.value("left", Json(nullptr));
    task.page->reply(progress);
  } else if (level == "error") {
    render.error += (render.error.empty() ? "" : "\n") + text;
  } else {
    task.page->reply({{"op", "log"}, {"id", task.id}, {"level", level}, {"text", text}});
  }
}

Json RenderQueue::run(Render& render) {
  const RenderTask& task = render.task;
  const auto started = [&](pid_t process) {
    const std::lock_guard lock(mutex_);
    render.process = process;
    if (render.is_cancelled) stop(render);
  };
  try {
    bool is_cancelled = false;
    {
      const std::lock_guard lock(mutex_);
      is_cancelled = render.is_cancelled;
    }
    ChildEnd end;
    if (!is_cancelled) {
      end =
          run_child(task.words, started, [&](const std::string& line) { take_line(render, line); });
      const std::lock_guard lock(mutex_);
      is_cancelled = render.is_cancelled && end.signal != 0;
    }
    if (is_cancelled) return {{"op", "cancelled"}, {"id", task.id}};
    constexpr int not_started = 127;
    if (end.code == not_started) render.error = "gstudio: cannot start " + task.words.front();
    if (end.signal != 0) render.error = fmt::format("gamer: stopped by signal {}", end.signal);
    if (end.code != 0 || end.signal != 0) return error_message(task.id, render.error);
    return {{"op", "rendered"}, {"id", task.id}, {"file", task.name}};
  } catch (const std::exception& error) {
    return error_message(task.id, error.what());
  }
}

}  // namespace gamer
