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

/// A folder of its own for each test, removed afterwards.
class ShellTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern =
        (std::filesystem::temp_directory_path() / "levelsmith-test-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// Runs `levelsmith ARGUMENTS` by a shell in the test's folder; ends it after `seconds`.
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

  /// Files in the folder, apart from the harness's own.
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

/// The command ended with `code_`, and the sentence on standard error has `part_` in it.
#define EXPECT_REFUSED(outcome_, code_, part_)                                        \
  do {                                                                                \
    const auto& refused_ = (outcome_);                                                \
    EXPECT_EQ(refused_.code, (code_)) << refused_.err;                                \
    EXPECT_NE(refused_.err.find(part_), std::string::npos) << "in: " << refused_.err; \
    EXPECT_EQ(refused_.out, "");                                                      \
  } while (false)
