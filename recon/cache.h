#pragma once
// The values computed last, for several threads.

#include <cstddef>
#include <list>
#include <mutex>
#include <unordered_map>
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
      if (const auto at = places_.find(index); at != places_.end()) {
        entries_.splice(entries_.begin(), entries_, at->second);
        return entries_.front().second;
      }
    }
    T value = make();
    const std::lock_guard lock(mutex_);
    if (places_.contains(index)) return value;
    entries_.emplace_front(index, value);
    places_[index] = entries_.begin();
    if (entries_.size() > capacity_) {
      places_.erase(entries_.back().first);
      entries_.pop_back();
    }
    return value;
  }

  void clear() {
    const std::lock_guard lock(mutex_);
    places_.clear();
    entries_.clear();
  }

 private:
  using Entries = std::list<std::pair<int, T>>;  // newest first
  std::size_t capacity_;
  std::mutex mutex_;
  Entries entries_;
  std::unordered_map<int, typename Entries::iterator> places_;
};

}  // namespace rugae
