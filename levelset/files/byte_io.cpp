#include "levelset/files/byte_io.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <system_error>
#include <utility>

#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"

namespace levelset {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kReadChunk = 1 << 22;
// zlib's windowBits: a window of 2¹⁵ bytes; adding 16 selects the gzip format, adding 32 detects
// gzip or zlib.
constexpr int kGzipWindow = 15 + 16, kAnyWindow = 15 + 32;

std::string systemMessage(int error) {
  return std::generic_category().message(error);
}

/// An open file, or standard input.
class InputFile {
 public:
  explicit InputFile(const fs::path& path) : name_(inputName(path)) {
    if (path.empty()) throw IoError("the file name is empty; name a file");
    if (path == "-") {
      fd_ = STDIN_FILENO;
      return;
    }
    fd_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (fd_ < 0) {
      const int error = errno;
      if (error == ENOENT) throw IoError(fmt::format("there is no file {}; check the name", name_));
      throw IoError(fmt::format("{} cannot be opened: {}; check its permissions", name_,
                                systemMessage(error)));
    }
    struct stat status {};
    if (::fstat(fd_, &status) != 0) return;
    if (S_ISDIR(status.st_mode)) {
      ::close(fd_);
      throw IoError(fmt::format("{} is a directory; name a file in it", name_));
    }
    if (S_ISREG(status.st_mode)) expected_ = static_cast<std::size_t>(status.st_size);
  }
  ~InputFile() {
    if (fd_ > STDIN_FILENO) ::close(fd_);
  }
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  /// Size of the file in bytes; 0 for pipes and standard input, whose size is unknown.
  [[nodiscard]] std::size_t expectedSize() const { return expected_; }
  [[nodiscard]] const std::string& name() const { return name_; }

  /// Maps the file into memory and returns its address; null when the file cannot be mapped.
  [[nodiscard]] void* mapped() const {
    if (expected_ == 0) return nullptr;
    void* begin = ::mmap(nullptr, expected_, PROT_READ, MAP_PRIVATE, fd_, 0);
    return begin == MAP_FAILED ? nullptr : begin;
  }

  /// Reads up to `size` bytes; returns 0 at the end.
  std::size_t read(char* to, std::size_t size) {
    for (;;) {
      const ssize_t count = ::read(fd_, to, size);
      if (count >= 0) return static_cast<std::size_t>(count);
      if (errno == EINTR) continue;
      throw IoError(
          fmt::format("{} cannot be read: {}; check the disk", name_, systemMessage(errno)));
    }
  }

 private:
  std::string name_;
  int fd_ = -1;
  std::size_t expected_ = 0;
};

[[noreturn]] void throwTooLarge(const std::string& name, std::size_t limit, bool inflated) {
  throw ResourceLimit(fmt::format(
      "{} {}exceeds the memory limit of {:.3g} GB; raise --max-memory or use a smaller file", name,
      inflated ? "when decompressed " : "", static_cast<double>(limit) * 1e-9));
}

/// Fills `bytes` with data from next(address, size), which returns the number of bytes it delivers.
/// Stops when next() returns 0 or `stopAt` bytes are present.
/// @param expected  expected number of bytes; 0 when unknown
/// @param limit  memory limit in bytes
/// @param inflated  true for decompressed data, for messages
template <typename Next>
void fill(Bytes& bytes, std::size_t expected, std::size_t limit, std::size_t stopAt,
          const std::string& name, bool inflated, Next next) {
  std::size_t used = 0;
  bytes.resize(std::min({std::max(expected + 1, std::size_t{1} << 16), limit, stopAt}));
  for (;;) {
    if (used == bytes.size()) {
      if (used >= stopAt) break;
      if (used >= limit) {
        char more;
        if (next(&more, 1) == 0) break;
        throwTooLarge(name, limit, inflated);
      }
      bytes.resize(std::min({used + std::max(used / 2, kReadChunk), limit, stopAt}));
    }
    const std::size_t count = next(bytes.data() + used, bytes.size() - used);
    if (count == 0) break;
    used += count;
  }
  bytes.resize(used);
}

bool isGzip(std::string_view bytes) {
  return bytes.size() >= 2 && bytes[0] == '\x1f' && bytes[1] == '\x8b';
}

/// Decompresses consecutive gzip members. Ignores data after them, as gzip does.
class Inflater {
 public:
  Inflater(std::string_view input, std::string name, int window = kGzipWindow)
      : rest_(input), name_(std::move(name)) {
    if (inflateInit2(&stream_, window) != Z_OK)
      throw ResourceLimit("not enough memory to decompress; close other programs");
  }
  ~Inflater() { inflateEnd(&stream_); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  std::size_t operator()(char* to, std::size_t size) {
    std::size_t produced = 0;
    while (produced < size && !done_) {
      const std::size_t in = std::min(rest_.size(), kReadChunk);
      const std::size_t out = std::min(size - produced, kReadChunk);
      stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(rest_.data()));
      stream_.avail_in = static_cast<uInt>(in);
      stream_.next_out = reinterpret_cast<Bytef*>(to + produced);
      stream_.avail_out = static_cast<uInt>(out);
      const int status = inflate(&stream_, Z_NO_FLUSH);
      rest_.remove_prefix(in - stream_.avail_in);
      produced += out - stream_.avail_out;
      if (status == Z_STREAM_END) {
        done_ = !isGzip(rest_) || inflateReset(&stream_) != Z_OK;
      } else if (status == Z_BUF_ERROR && rest_.empty()) {
        throwDamaged("ends in the middle");
      } else if (status != Z_OK) {
        throwDamaged("is damaged");
      }
    }
    return produced;
  }

 private:
  [[noreturn]] void throwDamaged(const char* how) const {
    throw InvalidInput(
        fmt::format("the compressed data of {} {}; download or create the file again", name_, how));
  }
  z_stream stream_{};
  std::string_view rest_;
  std::string name_;
  bool done_ = false;
};

}  // namespace

void Bytes::resize(std::size_t size) {
  char* grown = static_cast<char*>(std::realloc(data_.get(), std::max<std::size_t>(size, 1)));
  if (!grown) {
    throw ResourceLimit(
        fmt::format("not enough memory for {:.3g} GB; use a smaller file or free memory",
                    static_cast<double>(size) * 1e-9));
  }
  static_cast<void>(data_.release());
  data_.reset(grown);
  size_ = size;
}

std::string inputName(const fs::path& path) {
  return path == "-" ? "standard input" : fmt::format("'{}'", path.string());
}

namespace {

Bytes readAll(InputFile& file, std::size_t maxMemory) {
  const std::size_t limit = memoryLimit(maxMemory);
  Bytes raw;
  if (file.expectedSize() > limit) throwTooLarge(file.name(), limit, false);
  fill(raw, file.expectedSize(), limit, kNoMemoryLimit, file.name(), false,
       [&](char* to, std::size_t size) { return file.read(to, size); });
  if (raw.size() == 0)
    throw InvalidInput(fmt::format("{} is empty; download or create the file again", file.name()));
  if (!isGzip(raw.view())) return raw;
  Bytes inflated;
  fill(inflated, 4 * raw.size(), limit, kNoMemoryLimit, file.name(), true,
       Inflater(raw.view(), file.name()));
  if (inflated.size() == 0) {
    throw InvalidInput(
        fmt::format("{} is empty when decompressed; create the file again", file.name()));
  }
  return inflated;
}

}  // namespace

Bytes readBytes(const fs::path& path, std::size_t maxMemory) {
  InputFile file(path);
  return readAll(file, maxMemory);
}

MappedFile::MappedFile(const fs::path& path, std::size_t maxMemory, bool inflates) {
  InputFile file(path);
  mapped_ = file.mapped();
  size_ = file.expectedSize();
  if (mapped_ && (!inflates || !isGzip(view()))) return;
  if (mapped_) ::munmap(std::exchange(mapped_, nullptr), size_);
  read_ = readAll(file, maxMemory);
}

MappedFile::~MappedFile() {
  if (mapped_) ::munmap(mapped_, size_);
}

std::string_view MappedFile::view() const {
  return mapped_ ? std::string_view(static_cast<const char*>(mapped_), size_) : read_.view();
}

void MappedFile::release(std::size_t end) {
  constexpr std::size_t kInterval = 1 << 22;
  end -= end % kInterval;
  if (!mapped_ || end <= released_) return;
  ::madvise(static_cast<char*>(mapped_) + released_, end - released_, MADV_DONTNEED);
  released_ = end;
}

FirstBytes readFirstBytes(const fs::path& path, std::size_t count) {
  Bytes raw;
  InputFile file(path);
  fill(raw, 0, kNoMemoryLimit, count, file.name(), false,
       [&](char* to, std::size_t size) { return file.read(to, size); });
  const std::size_t fileSize = raw.size() < count ? raw.size() : 0;
  if (!isGzip(raw.view())) return {std::move(raw), std::max(file.expectedSize(), fileSize)};
  Bytes inflated;
  std::size_t produced = 0;
  inflated.resize(count);
  Inflater inflater(raw.view(), file.name());
  try {
    while (produced < count) {
      const std::size_t more =
          inflater(inflated.data() + produced, std::min<std::size_t>(count - produced, 512));
      if (more == 0) break;
      produced += more;
    }
  } catch (const InvalidInput&) {
    // Only the first `count` bytes of the file were read, so its compressed data may end early. The
    // data decompressed so far is the result.
  }
  inflated.resize(produced);
  return {std::move(inflated), fileSize > 0 && produced < count ? produced : 0};
}

Bytes decompress(std::string_view compressed, const std::string& name, std::size_t count) {
  Bytes inflated;
  fill(inflated, count, kNoMemoryLimit, count, name, true, Inflater(compressed, name, kAnyWindow));
  return inflated;
}

bool isGzipData(std::string_view bytes) {
  return isGzip(bytes);
}

struct ByteWriter::Deflater {
  z_stream stream{};
  std::unique_ptr<char[]> out = std::make_unique<char[]>(kCapacity);
  Deflater() {
    if (deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, kGzipWindow, 8,
                     Z_DEFAULT_STRATEGY) != Z_OK)
      throw ResourceLimit("not enough memory to compress; close other programs");
  }
  ~Deflater() { deflateEnd(&stream); }
};

ByteWriter::ByteWriter(const fs::path& target, bool compressed)
    : target_(target),
      name_(target == "-" ? "standard output" : fmt::format("'{}'", target.string())),
      buffer_(std::make_unique<char[]>(kCapacity)),
      deflater_(compressed ? std::make_unique<Deflater>() : nullptr) {
  fd_ = ::open(target_.path().c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC);
  if (fd_ < 0)
    throw IoError(
        fmt::format("{} cannot be opened: {}; check its permissions", name_, systemMessage(errno)));
}

ByteWriter::~ByteWriter() {
  if (fd_ >= 0) ::close(fd_);
}

void ByteWriter::writeNumber(double value) {
  char text[40];
  write(text, static_cast<std::size_t>(std::to_chars(text, text + sizeof text, value).ptr - text));
}

void ByteWriter::writeNumber(float value) {
  char text[24];
  write(text, static_cast<std::size_t>(std::to_chars(text, text + sizeof text, value).ptr - text));
}

void ByteWriter::writeNumber(std::uint64_t value) {
  char text[24];
  write(text, static_cast<std::size_t>(std::to_chars(text, text + sizeof text, value).ptr - text));
}

void ByteWriter::commit() {
  flush();
  if (deflater_) deflateBuffer(true);
  const int fd = std::exchange(fd_, -1);
  if (::close(fd) != 0)
    throw IoError(fmt::format("{} could not be written: {}; free disk space or write elsewhere",
                              name_, systemMessage(errno)));
  target_.commit();
}

void ByteWriter::writeSlowly(const char* data, std::size_t size) {
  while (size > 0) {
    if (used_ == kCapacity) flush();
    const std::size_t part = std::min(size, kCapacity - used_);
    std::memcpy(buffer_.get() + used_, data, part);
    used_ += part;
    data += part;
    size -= part;
  }
}

void ByteWriter::flush() {
  if (deflater_)
    deflateBuffer(false);
  else
    put(buffer_.get(), used_);
  used_ = 0;
}

void ByteWriter::deflateBuffer(bool finish) {
  z_stream& stream = deflater_->stream;
  stream.next_in = reinterpret_cast<Bytef*>(buffer_.get());
  stream.avail_in = static_cast<uInt>(used_);
  do {
    stream.next_out = reinterpret_cast<Bytef*>(deflater_->out.get());
    stream.avail_out = static_cast<uInt>(kCapacity);
    deflate(&stream, finish ? Z_FINISH : Z_NO_FLUSH);
    put(deflater_->out.get(), kCapacity - stream.avail_out);
  } while (stream.avail_out == 0);
}

void ByteWriter::put(const char* data, std::size_t size) {
  while (size > 0) {
    const ssize_t written = ::write(fd_, data, size);
    if (written < 0) {
      if (errno == EINTR) continue;
      throw IoError(fmt::format("{} could not be written: {}; free disk space or write elsewhere",
                                name_, systemMessage(errno)));
    }
    data += written;
    size -= static_cast<std::size_t>(written);
  }
}

}  // namespace levelset
