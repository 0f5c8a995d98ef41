#pragma once

// Internal header of levelset: public headers must not include it.

#include <cstddef>
#include <type_traits>
#include <utility>

namespace levelset::eikonal {

/// Pages of memory, filled with zeros. A page takes memory from its first use until its release.
class Pages {
 public:
  Pages() = default;
  explicit Pages(std::size_t bytes);
  ~Pages();
  Pages(Pages&& other) noexcept
      : begin_(std::exchange(other.begin_, nullptr)), bytes_(std::exchange(other.bytes_, 0)) {}
  Pages& operator=(Pages&& other) noexcept {
    std::swap(begin_, other.begin_);
    std::swap(bytes_, other.bytes_);
    return *this;
  }
  Pages(const Pages&) = delete;
  Pages& operator=(const Pages&) = delete;

  [[nodiscard]] void* begin() const { return begin_; }
  /// Returns the complete pages in [first, end) bytes to the system.
  void release(std::size_t first, std::size_t end);

 private:
  void* begin_ = nullptr;
  std::size_t bytes_ = 0;
};

/// Array of a fixed length, filled with zeros. An entry takes memory from the first use of its page
/// until its release.
template <typename T>
class PageArray {
  static_assert(std::is_trivially_destructible_v<T>);

 public:
  PageArray() = default;
  explicit PageArray(std::size_t size) : pages_(size * sizeof(T)), size_(size) {}
  PageArray(PageArray&& other) noexcept
      : pages_(std::move(other.pages_)), size_(std::exchange(other.size_, 0)) {}
  PageArray& operator=(PageArray&& other) noexcept {
    pages_ = std::move(other.pages_);
    size_ = std::exchange(other.size_, 0);
    return *this;
  }

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] T* data() { return static_cast<T*>(pages_.begin()); }
  [[nodiscard]] const T* data() const { return static_cast<const T*>(pages_.begin()); }
  [[nodiscard]] T& operator[](std::size_t i) { return data()[i]; }
  [[nodiscard]] const T& operator[](std::size_t i) const { return data()[i]; }
  [[nodiscard]] T* begin() { return data(); }
  [[nodiscard]] T* end() { return data() + size_; }
  [[nodiscard]] const T* begin() const { return data(); }
  [[nodiscard]] const T* end() const { return data() + size_; }

  /// Gives up the entries [first, end). They must not be used any more.
  void release(std::size_t first, std::size_t end) {
    pages_.release(first * sizeof(T), end * sizeof(T));
  }

 private:
  Pages pages_;
  std::size_t size_ = 0;
};

}  // namespace levelset::eikonal
