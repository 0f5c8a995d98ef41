#include "levelset/file_target.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <mutex>
#include <set>
#include <string>
#include <system_error>
#include <vector>

#include "levelset/error.h"

namespace levelset {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxLinks = 40;  // limit of the Linux kernel for nested symbolic links
// Bytes of the target's name that the name of the temporary file keeps, to stay below NAME_MAX.
constexpr std::size_t kMaxStem = 180;
constexpr std::size_t kCopyChunk = 1 << 20;

std::atomic<bool> mayClobber{true};

/// Paths of the temporary files of this process. The mutex is locked for single system calls only.
struct Registry {
  std::mutex mutex;
  std::set<std::string> names;
  bool closed = false;
};

Registry& registry() {
  // Never deleted, so that destructors of static objects may still write files.
  static Registry* instance = new Registry;
  return *instance;
}

[[noreturn]] void throwIo(const fs::path& target, const std::string& what) {
  throw IoError(fmt::format("'{}' {}", target.string(), what));
}

[[noreturn]] void throwErrno(const fs::path& target, const char* what, int error) {
  const char* advice = "";
  if (error == ENOSPC || error == EDQUOT) advice = "; make room on the disk or write elsewhere";
  if (error == EACCES || error == EPERM || error == EROFS)
    advice = "; check its permissions or write elsewhere";
  if (error == EPIPE) advice = "; the program that reads it has ended";
  throwIo(target, fmt::format("{}: {}{}", what, std::generic_category().message(error), advice));
}

[[noreturn]] void throwCancelled(const fs::path& target) {
  throw Cancelled(fmt::format("the job was interrupted and '{}' is unchanged", target.string()));
}

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int get() const { return fd_; }

 private:
  int fd_;
};

/// Blocks SIGPIPE in this thread. A write to a pipe without a reader raises SIGPIPE, which ends the
/// process. With the signal blocked, the write returns EPIPE and the caller gets an error message.
class SigpipeGuard {
 public:
  SigpipeGuard() {
    sigemptyset(&pipe_);
    sigaddset(&pipe_, SIGPIPE);
    sigset_t pending;
    sigpending(&pending);
    wasPending_ = sigismember(&pending, SIGPIPE) == 1;
    pthread_sigmask(SIG_BLOCK, &pipe_, &before_);
  }
  ~SigpipeGuard() {
    const timespec now{0, 0};
    if (!wasPending_)
      while (sigtimedwait(&pipe_, nullptr, &now) == -1 && errno == EINTR) {
      }
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }
  SigpipeGuard(const SigpipeGuard&) = delete;
  SigpipeGuard& operator=(const SigpipeGuard&) = delete;

 private:
  sigset_t pipe_{}, before_{};
  bool wasPending_ = false;
};

/// Returns the descriptor N when the path is /proc/PID/fd/N of this process, else -1.
int ownDescriptor(const fs::path& path) {
  const fs::path folder = path.parent_path();
  if (folder != fmt::format("/proc/{}/fd", ::getpid()) && folder != "/proc/self/fd") return -1;
  const std::string name = path.filename().string();
  int fd = -1;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), fd);
  return error == std::errc{} && end == name.data() + name.size() ? fd : -1;
}

/// Resolves links one by one and stops at an open descriptor of this process. The file behind a
/// descriptor may have no name, and must not be truncated if it has one.
fs::path followLinks(const fs::path& target) {
  fs::path current = fs::absolute(target);
  for (int i = 0; i < kMaxLinks; ++i) {
    std::error_code error;
    const fs::path folder = fs::canonical(current.parent_path(), error);
    if (!error) current = folder / current.filename();
    if (ownDescriptor(current) >= 0 || !fs::is_symlink(current, error)) return current;
    const fs::path next = fs::read_symlink(current, error);
    if (error) return current;
    current = next.is_absolute() ? next : current.parent_path() / next;
  }
  throwIo(target, "is a symbolic link that leads back to itself; name the file itself");
}

void writeAll(int fd, const char* data, std::size_t size, const fs::path& target) {
  while (size > 0) {
    const ssize_t written = ::write(fd, data, size);
    if (written < 0) {
      if (errno == EINTR) continue;
      throwErrno(target, "could not be written", errno);
    }
    data += written;
    size -= static_cast<std::size_t>(written);
  }
}

/// Refuses a device that accepts no data. Such a device, for example /dev/full, fails on a write of
/// zero bytes.
void requireWritable(int fd, const fs::path& target) {
  if (fd < 0) throwErrno(target, "cannot be opened for writing", errno);
  struct stat status {};
  if (::fstat(fd, &status) != 0 || !S_ISCHR(status.st_mode)) return;
  if (::write(fd, "", 0) < 0) throwErrno(target, "could not be written", errno);
}

bool isClosed() {
  const std::lock_guard lock(registry().mutex);
  return registry().closed;
}

}  // namespace

FileTarget::FileTarget(const fs::path& target, bool clobber)
    : target_(target), clobber_(clobber && mayClobber) {
  if (target.empty()) throw IoError("the file name is empty; name a file");
  if (target == "-") {
    target_ = "standard output";
    descriptor_ = STDOUT_FILENO;
  } else {
    finalPath_ = followLinks(target);
    descriptor_ = ownDescriptor(finalPath_);
  }
  struct stat status {};
  const bool exists = descriptor_ < 0 && ::stat(finalPath_.c_str(), &status) == 0;
  if (exists && S_ISDIR(status.st_mode)) throwIo(target_, "is a directory; name a file in it");
  copiesToTarget_ = descriptor_ >= 0 || (exists && !S_ISREG(status.st_mode));
  if (copiesToTarget_) {
    if (descriptor_ >= 0) {
      requireWritable(descriptor_, target_);
    } else if (S_ISCHR(status.st_mode)) {  // opening a pipe could wait for its reader
      requireWritable(Descriptor(::open(finalPath_.c_str(), O_WRONLY | O_CLOEXEC)).get(), target_);
    }
    std::error_code error;
    const fs::path folder = fs::temp_directory_path(error);
    createTemporary(error ? fs::path("/tmp") : folder, "levelsmith-output");
    return;
  }
  if (exists && !clobber_)
    throwIo(target_,
            "exists already, and --no-clobber forbids overwriting it; choose another name");
  if (exists && ::access(finalPath_.c_str(), W_OK) != 0)
    throwErrno(target_, "cannot be overwritten", errno);
  createTemporary(finalPath_.parent_path(), finalPath_.filename().string());
}

void FileTarget::createTemporary(const fs::path& folder, std::string name) {
  static std::atomic<unsigned> counter{0};
  if (name.size() > kMaxStem) {
    // Does not cut inside a UTF-8 character: some file systems refuse incomplete characters.
    std::size_t cut = kMaxStem;
    while (cut > 0 && (static_cast<unsigned char>(name[cut]) & 0xC0) == 0x80) --cut;
    name.resize(cut);
  }
  for (;;) {
    const fs::path candidate =
        folder / fmt::format(".{}.{}-{}.tmp", name, ::getpid(), counter.fetch_add(1));
    const std::lock_guard lock(registry().mutex);
    if (registry().closed) throwCancelled(target_);
    const Descriptor file(::open(candidate.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
    if (file.get() >= 0) {
      path_ = candidate;
      registry().names.insert(candidate.string());
      return;
    }
    if (errno == EEXIST) continue;
    if (errno == ENOENT || errno == ENOTDIR)
      throwIo(target_, fmt::format("cannot be created: there is no folder '{}'; create it first",
                                   folder.string()));
    throwErrno(target_, "cannot be created", errno);
  }
}

FileTarget::~FileTarget() {
  if (committed_ || path_.empty()) return;
  const std::lock_guard lock(registry().mutex);
  if (registry().names.erase(path_.string()) > 0) ::unlink(path_.c_str());
}

void FileTarget::commit() {
  if (copiesToTarget_) {
    copyToTarget();
    return;  // the destructor removes the copy
  }
  {
    const Descriptor file(::open(path_.c_str(), O_RDONLY | O_CLOEXEC));
    if (file.get() < 0) {
      if (isClosed()) throwCancelled(target_);
      throwErrno(target_, "could not be written", errno);
    }
    if (::fsync(file.get()) != 0 && errno != EINVAL && errno != ENOTSUP)
      throwErrno(target_, "could not be written", errno);
    struct stat status {};
    if (::stat(finalPath_.c_str(), &status) == 0) ::fchmod(file.get(), status.st_mode & 07777);
  }
  const std::lock_guard lock(registry().mutex);
  if (registry().closed) throwCancelled(target_);
  const unsigned flags = clobber_ ? 0 : RENAME_NOREPLACE;
  int result = ::renameat2(AT_FDCWD, path_.c_str(), AT_FDCWD, finalPath_.c_str(), flags);
  if (result != 0 && (errno == EINVAL || errno == ENOSYS))  // the file system supports no flags
    result = ::rename(path_.c_str(), finalPath_.c_str());
  if (result != 0) throwErrno(target_, "could not be renamed to its final name", errno);
  registry().names.erase(path_.string());
  committed_ = true;
}

void FileTarget::copyToTarget() {
  const SigpipeGuard guard;
  const Descriptor source(::open(path_.c_str(), O_RDONLY | O_CLOEXEC));
  if (source.get() < 0) {
    if (isClosed()) throwCancelled(target_);
    throwErrno(target_, "could not be written", errno);
  }
  const Descriptor sink(descriptor_ >= 0 ? ::fcntl(descriptor_, F_DUPFD_CLOEXEC, 0)
                                         : ::open(finalPath_.c_str(), O_WRONLY | O_CLOEXEC));
  if (sink.get() < 0) throwErrno(target_, "cannot be opened for writing", errno);
  std::vector<char> chunk(kCopyChunk);
  for (;;) {
    const ssize_t count = ::read(source.get(), chunk.data(), chunk.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throwErrno(target_, "could not be written", errno);
    if (count == 0) return;
    if (isClosed()) throwCancelled(target_);
    writeAll(sink.get(), chunk.data(), static_cast<std::size_t>(count), target_);
  }
}

bool isStandardOutput(const fs::path& target) {
  if (target.empty()) return false;
  return target == "-" || ownDescriptor(followLinks(target)) == STDOUT_FILENO;
}

fs::path canonicalFile(const fs::path& file) {
  if (file == "-") return {};
  std::error_code error;
  fs::path path = fs::weakly_canonical(fs::absolute(file, error), error);
  return !fs::exists(path, error) || fs::is_regular_file(path, error) ? path : fs::path();
}

bool isSameFile(const fs::path& a, const fs::path& b) {
  if (a == "-" || b == "-") return isStandardOutput(a) && isStandardOutput(b);
  const fs::path first = canonicalFile(a);
  return !first.empty() && first == canonicalFile(b);
}

void removeTemporaryFiles() noexcept {
  Registry& files = registry();
  const std::lock_guard lock(files.mutex);
  files.closed = true;
  for (const std::string& name : files.names) ::unlink(name.c_str());
  files.names.clear();
}

void setClobberDefault(bool clobber) {
  mayClobber = clobber;
}
bool clobberDefault() {
  return mayClobber;
}

}  // namespace levelset
