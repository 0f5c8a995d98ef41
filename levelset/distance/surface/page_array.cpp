#include "levelset/distance/surface/page_array.h"

#include <sys/mman.h>
#include <unistd.h>

#include <new>

namespace levelset::eikonal {

Pages::Pages(std::size_t bytes) : bytes_(bytes) {
  if (bytes == 0) return;
  void* begin = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE,
                       MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (begin == MAP_FAILED) throw std::bad_alloc();
  begin_ = begin;
#ifdef MADV_NOHUGEPAGE
  // A huge page would stay until all entries in its 2 MB are released.
  (void)::madvise(begin_, bytes_, MADV_NOHUGEPAGE);
#endif
}

Pages::~Pages() {
  if (begin_) ::munmap(begin_, bytes_);
}

void Pages::release(std::size_t first, std::size_t end) {
  static const auto kPage = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  first = (first + kPage - 1) / kPage * kPage;
  end = end / kPage * kPage;
  if (first < end) (void)::madvise(static_cast<char*>(begin_) + first, end - first, MADV_DONTNEED);
}

}  // namespace levelset::eikonal
