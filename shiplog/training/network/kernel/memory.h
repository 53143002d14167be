// Aligned arrays that are kept for the next call, and groups of work on threads.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <map>
#include <mutex>
#include <new>
#include <thread>
#include <utility>
#include <vector>

namespace shiplog {

// Blocks that were freed wait here: fresh pages cost as much as a tenth of an update.
class Pool {
 public:
  void* take(size_t bytes) {
    {
      const std::lock_guard<std::mutex> lock(guard);
      const auto found = free_blocks.find(bytes);
      if (found != free_blocks.end()) {
        void* block = found->second;
        free_blocks.erase(found);
        held -= bytes;
        return block;
      }
    }
    void* block = nullptr;
    if (posix_memalign(&block, 64, bytes)) throw std::bad_alloc();
    return block;
  }
  void give(void* block, size_t bytes) {
    const std::lock_guard<std::mutex> lock(guard);
    if (held + bytes > MOST) {
      std::free(block);
      return;
    }
    free_blocks.emplace(bytes, block);
    held += bytes;
  }

 private:
  static constexpr size_t MOST = size_t(48) << 20;  // bytes
  std::mutex guard;
  std::multimap<size_t, void*> free_blocks;
  size_t held = 0;
};

Pool& pool();

// An array whose elements are not set.
template <class T> struct Memory {
  T* data = nullptr;
  size_t size = 0;

  Memory() = default;
  explicit Memory(int64_t n) : size(size_t(n)) {
    if (n) data = static_cast<T*>(pool().take(bytes()));
  }
  Memory(Memory&& other) noexcept { swap(other); }
  Memory& operator=(Memory&& other) noexcept {
    swap(other);
    return *this;
  }
  ~Memory() {
    if (data) pool().give(data, bytes());
  }
  void clear() {
    if (data) std::memset(data, 0, bytes());
  }

 private:
  size_t bytes() const { return (size * sizeof(T) + 63) / 64 * 64; }
  void swap(Memory& other) {
    std::swap(data, other.data);
    std::swap(size, other.size);
  }
};

// work(0) ... work(count - 1), on at most `threads` threads.
void in_parallel(int64_t count, int threads, const std::function<void(int64_t)>& work);

}  // namespace shiplog
