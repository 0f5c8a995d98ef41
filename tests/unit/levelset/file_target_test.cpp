#include "levelset/file_target.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <thread>

#include "levelset/error.h"
#include "tests/support/files.h"

namespace file_target_test {

namespace fs = std::filesystem;
using levelset::FileTarget;
using support::readText;
using support::refusal;
using support::TemporaryFolder;
using support::writeText;

mode_t modeOf(const fs::path& path) {
  struct stat status {};
  EXPECT_EQ(::stat(path.c_str(), &status), 0);
  return status.st_mode & 07777;
}

TEST(FileTarget, MovesTheFileIntoPlaceOnCommitOnly) {
  const TemporaryFolder folder;
  const fs::path file = folder / "out.ply";
  writeText(file, "before");
  FileTarget target(file);
  EXPECT_EQ(target.path().parent_path(), folder.path());
  writeText(target.path(), "after");
  EXPECT_EQ(readText(file), "before");
  target.commit();
  EXPECT_EQ(readText(file), "after");
  EXPECT_EQ(folder.fileCount(), 1u);
}

TEST(FileTarget, LeavesNothingBehindWithoutCommit) {
  const TemporaryFolder folder;
  writeText(folder / "out.ply", "before");
  {
    const FileTarget target(folder / "out.ply");
    writeText(target.path(), "half a fi");
    EXPECT_EQ(folder.fileCount(), 2u);
  }
  EXPECT_EQ(readText(folder / "out.ply"), "before");
  EXPECT_EQ(folder.fileCount(), 1u);
}

TEST(FileTarget, KeepsPermissionsAndFollowsUmask) {
  const TemporaryFolder folder;
  writeText(folder / "old", "before");
  fs::permissions(folder / "old", static_cast<fs::perms>(0640));
  const mode_t mask = ::umask(027);
  for (const char* name : {"old", "new"}) {
    FileTarget target(folder / name);
    target.commit();
  }
  ::umask(mask);
  EXPECT_EQ(modeOf(folder / "old"), 0640u);
  EXPECT_EQ(modeOf(folder / "new"), 0640u);  // 0666 & ~027
  EXPECT_EQ(readText(folder / "old"), "");
}

TEST(FileTarget, KeepsALinkAndReplacesItsTarget) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "far");
  writeText(folder / "far/real", "before");
  fs::create_symlink("far/real", folder / "near");
  fs::create_symlink("near", folder / "nearer");
  FileTarget target(folder / "nearer");
  writeText(target.path(), "after");
  target.commit();
  EXPECT_TRUE(fs::is_symlink(folder / "near"));
  EXPECT_FALSE(fs::is_symlink(folder / "far/real"));
  EXPECT_EQ(readText(folder / "far/real"), "after");
}

TEST(FileTarget, WritesThroughADanglingLink) {
  const TemporaryFolder folder;
  fs::create_symlink("later", folder / "link");
  FileTarget target(folder / "link");
  writeText(target.path(), "text");
  target.commit();
  EXPECT_EQ(readText(folder / "later"), "text");
}

TEST(FileTarget, WritesThroughAPipe) {
  const TemporaryFolder folder;
  const fs::path pipe = folder / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const std::string sent(300000, 'x');  // more than the buffer of a pipe
  std::string received;
  std::thread reader([&] { received = readText(pipe); });
  FileTarget target(pipe);
  writeText(target.path(), sent);
  target.commit();
  reader.join();
  EXPECT_EQ(received, sent);
  EXPECT_TRUE(fs::is_fifo(pipe));
}

/// Redirects standard output of the process to `fd` during its lifetime.
class StandardOutput {
 public:
  explicit StandardOutput(int fd) : before_(::dup(STDOUT_FILENO)) { ::dup2(fd, STDOUT_FILENO); }
  ~StandardOutput() {
    ::dup2(before_, STDOUT_FILENO);
    ::close(before_);
  }
  StandardOutput(const StandardOutput&) = delete;
  StandardOutput& operator=(const StandardOutput&) = delete;

 private:
  int before_;
};

TEST(FileTarget, AppendsToStandardOutput) {
  const TemporaryFolder folder;
  for (const char* name : {"-", "/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"}) {
    writeText(folder / "log", "first ");
    const int fd = ::open((folder / "log").c_str(), O_WRONLY | O_APPEND);
    {
      const StandardOutput redirected(fd);
      FileTarget target(name);
      writeText(target.path(), "second");
      target.commit();
    }
    ::close(fd);
    EXPECT_EQ(readText(folder / "log"), "first second") << name;
  }
}

TEST(FileTarget, RecognizesStandardOutputAndEqualPaths) {
  for (const char* name : {"-", "/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"})
    EXPECT_TRUE(levelset::isStandardOutput(name)) << name;
  for (const char* name : {"", "stdout", "/dev/stderr", "/dev/null"})
    EXPECT_FALSE(levelset::isStandardOutput(name)) << name;
  const TemporaryFolder folder;
  fs::create_symlink("/dev/stdout", folder / "link");
  EXPECT_TRUE(levelset::isStandardOutput(folder / "link"));
  EXPECT_TRUE(levelset::isSameFile(folder / "a", folder / "." / "a"));
  EXPECT_FALSE(levelset::isSameFile(folder / "a", folder / "b"));
  EXPECT_FALSE(levelset::isSameFile("/dev/null", "/dev/null"));
  EXPECT_TRUE(levelset::isSameFile("-", "/dev/stdout"));
}

TEST(FileTarget, ReportsThatTheReaderIsGone) {
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  ::close(ends[0]);
  std::string sentence;
  {
    const StandardOutput redirected(ends[1]);
    sentence = refusal<levelset::IoError>([] {
      FileTarget target("-");
      writeText(target.path(), "text");
      target.commit();
    });
  }
  ::close(ends[1]);
  EXPECT_NE(sentence.find("Broken pipe"), std::string::npos) << sentence;
}

TEST(FileTarget, ReportsThatTheDiskIsFull) {
  const std::string sentence = refusal<levelset::IoError>([] {
    FileTarget target("/dev/full");
    writeText(target.path(), "text");
    target.commit();
  });
  EXPECT_NE(sentence.find("'/dev/full'"), std::string::npos) << sentence;
  EXPECT_NE(sentence.find("No space left"), std::string::npos) << sentence;
}

TEST(FileTarget, AcceptsTheNullDevice) {
  FileTarget target("/dev/null");
  writeText(target.path(), "text");
  EXPECT_NO_THROW(target.commit());
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST(FileTarget, RefusesUnwritablePaths) {
  const TemporaryFolder folder;
  const auto sentence = [](const fs::path& path) {
    return refusal<levelset::IoError>([&] { const FileTarget target(path); });
  };
  EXPECT_NE(sentence(folder / "missing/out").find("there is no folder"), std::string::npos);
  EXPECT_NE(sentence(folder.path()).find("is a directory"), std::string::npos);
  EXPECT_NE(sentence("").find("name is empty"), std::string::npos);
  writeText(folder / "file", "text");
  EXPECT_NE(sentence(folder / "file/out").find("there is no folder"), std::string::npos);
  fs::create_symlink("loop", folder / "loop");
  EXPECT_NE(sentence(folder / "loop").find("leads back"), std::string::npos);
}

TEST(FileTarget, ObeysNoClobber) {
  const TemporaryFolder folder;
  writeText(folder / "out", "before");
  EXPECT_NE(refusal<levelset::IoError>([&] {
              const FileTarget target(folder / "out", false);
            }).find("--no-clobber"),
            std::string::npos);
  levelset::setClobberDefault(false);
  EXPECT_THROW(FileTarget(folder / "out"), levelset::IoError);
  FileTarget late(folder / "late");
  writeText(late.path(), "mine");
  writeText(folder / "late", "came first");
  EXPECT_THROW(late.commit(), levelset::IoError);
  levelset::setClobberDefault(true);
  EXPECT_EQ(readText(folder / "late"), "came first");
}

TEST(FileTarget, TakesLongAndNonAsciiNames) {
  const TemporaryFolder folder;
  std::string name;
  for (int i = 0; i < 120; ++i) name += "\xC3\xA9";  // é: 240 bytes
  FileTarget target(folder / name);
  writeText(target.path(), "text");
  target.commit();
  EXPECT_EQ(readText(folder / name), "text");
}

// Runs in a separate process, because no FileTarget of the process works afterwards.
TEST(FileTargetDeathTest, RemovesTemporaryFilesAndRenamesNothing) {
  const TemporaryFolder folder;
  writeText(folder / "out", "before");
  EXPECT_EXIT(
      {
        FileTarget target(folder / "out");
        writeText(target.path(), "after");
        std::thread([] { levelset::removeTemporaryFiles(); }).join();
        int code = folder.fileCount() == 1 ? 0 : 1;
        try {
          target.commit();
          code = 2;
        } catch (const levelset::Cancelled&) {
        }
        try {
          const FileTarget next(folder / "next");
          code = 3;
        } catch (const levelset::Cancelled&) {
        }
        ::_exit(code);
      },
      testing::ExitedWithCode(0), "");
  EXPECT_EQ(readText(folder / "out"), "before");
  EXPECT_EQ(folder.fileCount(), 1u);
}

}  // namespace file_target_test
