#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <utility>

namespace gamer {

/// Values that equal users share while one of them holds them, by key. Safe for several threads.
template <class Key, class Value>
class SharedValues {
 public:
  /// The value of `key`, which `make()` returns if nobody holds one.
  template <class Make>
  std::shared_ptr<const Value> find(Key key, const Make& make) {
    const std::lock_guard lock(mutex_);
    if (const auto found = known_.find(key); found != known_.end()) {
      if (auto value = found->second.lock()) return value;
    }
    std::erase_if(known_, [](const auto& entry) { return entry.second.expired(); });
    std::shared_ptr<const Value> value = make();
    known_[std::move(key)] = value;
    return value;
  }

 private:
  std::mutex mutex_;
  std::map<Key, std::weak_ptr<const Value>> known_;
};

}  // namespace gamer
