#pragma once
// The values computed last, for several threads.

#include <cstddef>
#include <list>
#include <mutex>
#include <utility>

namespace rugae {

/// Holds the values of the `capacity` indices asked for last.
template <typename T>
class Cache {
 public:
  explicit Cache(std::size_t capacity) : capacity_(capacity) {}

  /// The value of `index`, from make() where it is not held. Two threads may make the same value;
  /// neither waits for the other.
  template <typename Make>
  T get(int index, Make make) {
    {
      const std::lock_guard lock(mutex_);
      for (auto entry = entries_.begin(); entry != entries_.end(); ++entry) {
        if (entry->first != index) continue;
        entries_.splice(entries_.begin(), entries_, entry);
        return entries_.front().second;
      }
    }
    T value = make();
    const std::lock_guard lock(mutex_);
    entries_.emplace_front(index, value);
    if (entries_.size() > capacity_) entries_.pop_back();
    return value;
  }

 private:
  std::size_t capacity_;
  std::mutex mutex_;
  std::list<std::pair<int, T>> entries_;  // newest first
};

}  // namespace rugae
