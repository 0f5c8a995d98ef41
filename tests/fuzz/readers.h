#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

/// Readers of files and texts from others, each under one name, tested with arbitrary bytes. The
/// fuzzer runs them (fuzz_main.cpp), and the unit tests run them on the corpus (replay_test.cpp).
namespace fuzz {

/// Memory limit given to each reader, bytes.
inline constexpr std::size_t kMaxMemory = std::size_t{64} << 20;

struct Reader {
  const char* name;  ///< name of the reader and of its folder in tests/fuzz/corpus
  /// Reads the bytes or rejects them with a levelset::Error. Any other exception is a defect.
  void (*read)(std::string_view bytes);
};
[[nodiscard]] const std::vector<Reader>& readers();
[[nodiscard]] const Reader* findReader(std::string_view name);

// Each source file of readers provides its own list.
[[nodiscard]] std::vector<Reader> meshReaders();
[[nodiscard]] std::vector<Reader> gridReaders();
[[nodiscard]] std::vector<Reader> volumeReaders();
[[nodiscard]] std::vector<Reader> pointReaders();
[[nodiscard]] std::vector<Reader> pictureReaders();
[[nodiscard]] std::vector<Reader> documentReaders();
[[nodiscard]] std::vector<Reader> grammarReaders();

/// Writes the bytes to a file of that name in a folder of this process, in memory if possible.
[[nodiscard]] std::filesystem::path scratchFile(const std::string& name, std::string_view bytes);

/// Runs `job`.
/// @return true if it completes; false if a levelset::Error rejects the input
template <typename Job>
bool accepts(const Job& job);

/// Aborts with message `what` unless `isTrue`, with or without NDEBUG.
void require(bool isTrue, const char* what);

}  // namespace fuzz

#include "levelset/error.h"

namespace fuzz {

template <typename Job>
bool accepts(const Job& job) {
  try {
    job();
    return true;
  } catch (const levelset::Error& refusal) {
    require(*refusal.what() != '\0', "a refusal says something");
    return false;
  }
}

}  // namespace fuzz
