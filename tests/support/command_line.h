#pragma once

// Runs the levelsmith command as a user would.

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace support {

struct Outcome {
  int code = 0;
  std::string out, err;
};

inline std::string slurp(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// Gives each test a folder of its own and removes it afterwards.
class ShellTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern =
        (std::filesystem::temp_directory_path() / "levelsmith-test-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// Runs `levelsmith ARGUMENTS` in a shell in the test's folder. Ends it after `seconds`.
  Outcome levelsmith(const std::string& arguments, int seconds = 60) {
    return shell(command() + " " + arguments, seconds);
  }

  Outcome shell(const std::string& line, int seconds = 60) {
    std::ofstream(folder_ / ".line") << line << "\n";
    const std::string wrapped = "cd '" + folder_.string() + "' && timeout -s KILL " +
                                std::to_string(seconds) + " bash .line >.out 2>.err </dev/null";
    const int status = std::system(wrapped.c_str());
    Outcome outcome;
    outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    outcome.out = slurp(folder_ / ".out");
    outcome.err = slurp(folder_ / ".err");
    return outcome;
  }

  void writeFile(const std::string& name, const std::string& content) {
    std::ofstream(folder_ / name, std::ios::binary) << content;
  }

  [[nodiscard]] bool exists(const std::string& name) const {
    return std::filesystem::exists(folder_ / name);
  }

  /// Number of files in the folder, without those of the harness.
  [[nodiscard]] std::size_t fileCount() const {
    std::size_t count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
      const std::string name = entry.path().filename().string();
      count += name != ".line" && name != ".out" && name != ".err";
    }
    return count;
  }

  static std::string command() { return LEVELSMITH_COMMAND; }

  std::filesystem::path folder_;
};

}  // namespace support

/// Expects that the command exits with `code_`, and that its message on standard error contains
/// `part_`.
#define EXPECT_REFUSED(outcome_, code_, part_)                                        \
  do {                                                                                \
    const auto& refused_ = (outcome_);                                                \
    EXPECT_EQ(refused_.code, (code_)) << refused_.err;                                \
    EXPECT_NE(refused_.err.find(part_), std::string::npos) << "in: " << refused_.err; \
    EXPECT_EQ(refused_.out, "");                                                      \
  } while (false)
