#include "levelset/terrain/tiles/tile_file_target.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

#include "levelset/error.h"

namespace levelset::terrain {
namespace {

constexpr std::size_t kMostWaiting = std::size_t{1} << 20;

}  // namespace

TileFileTarget::TileFileTarget(const std::filesystem::path& target)
    : target_(target), name_(target.string()) {
  descriptor_ = ::open(target_.path().c_str(), O_RDWR | O_TRUNC | O_CLOEXEC);
  if (descriptor_ < 0) fail("cannot be opened");
}

TileFileTarget::~TileFileTarget() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void TileFileTarget::fail(const char* what) const {
  throw IoError(fmt::format("'{}' {}: {}; free disk space or write elsewhere", name_, what,
                            std::generic_category().message(errno)));
}

void TileFileTarget::append(std::string_view bytes) {
  waiting_ += bytes;
  if (waiting_.size() >= kMostWaiting) flush();
}

void TileFileTarget::flush() {
  writeAt(written_, waiting_);
  written_ += waiting_.size();
  waiting_.clear();
}

void TileFileTarget::writeAt(std::uint64_t offset, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count =
        ::pwrite(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (count < 0 && errno == EINTR) continue;
    if (count == 0) errno = ENOSPC;
    if (count <= 0) fail("could not be written");
    bytes.remove_prefix(static_cast<std::size_t>(count));
    offset += static_cast<std::uint64_t>(count);
  }
}

std::string TileFileTarget::read(std::uint64_t offset, std::size_t bytes) const {
  std::string read(bytes, '\0');
  for (std::size_t done = 0; done < bytes;) {
    const ssize_t count =
        ::pread(descriptor_, read.data() + done, bytes - done, static_cast<off_t>(offset + done));
    if (count < 0 && errno == EINTR) continue;
    if (count == 0) errno = EIO;  // another process has cut the file
    if (count <= 0) fail("could not be read again");
    done += static_cast<std::size_t>(count);
  }
  return read;
}

void TileFileTarget::commit(std::string_view firstBytes) {
  flush();
  writeAt(0, firstBytes);
  if (::close(std::exchange(descriptor_, -1)) != 0) fail("could not be written");
  target_.commit();
}

}  // namespace levelset::terrain
