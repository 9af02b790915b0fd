#pragma once

#include <map>
#include <memory>
#include <mutex>

namespace gamer {

/// Values by key. Users who ask for one key share its value, as long as one of them holds it. Safe
/// for several threads.
template <class Key, class Value>
class SharedValues {
 public:
  /// The value of `key`, which `make()` returns if nobody holds one. Threads that ask at one time
  /// may all make it, and one of the values is kept.
  template <class Make>
  std::shared_ptr<const Value> find(const Key& key, const Make& make) {
    if (auto value = known(key)) return value;
    std::shared_ptr<const Value> made = make();
    const std::lock_guard lock(mutex_);
    std::erase_if(known_, [](const auto& entry) { return entry.second.expired(); });
    std::weak_ptr<const Value>& entry = known_[key];
    if (auto value = entry.lock()) return value;
    entry = made;
    return made;
  }

 private:
  std::shared_ptr<const Value> known(const Key& key) {
    const std::lock_guard lock(mutex_);
    const auto found = known_.find(key);
    return found != known_.end() ? found->second.lock() : nullptr;
  }

  std::mutex mutex_;
  std::map<Key, std::weak_ptr<const Value>> known_;
};

}  // namespace gamer
