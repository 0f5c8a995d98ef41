#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

/// What reads files and texts that others wrote, each by one name, to be tried with whatever bytes:
/// by libFuzzer (fuzz_main.cpp), and with the corpus by the unit tests (replay_test.cpp).
namespace fuzz {

/// Bytes that a reader is told it may use.
inline constexpr std::size_t kMaxMemory = std::size_t{64} << 20;

struct Reader {
  const char* name;  ///< also of its folder in tests/fuzz/corpus
  /// Takes the bytes or refuses them by a levelset::Error; whatever else leaves it is a defect.
  void (*read)(std::string_view bytes);
};
[[nodiscard]] const std::vector<Reader>& readers();
[[nodiscard]] const Reader* findReader(std::string_view name);

// Each file of readers tells its own.
[[nodiscard]] std::vector<Reader> meshReaders();
[[nodiscard]] std::vector<Reader> gridReaders();
[[nodiscard]] std::vector<Reader> pictureReaders();
[[nodiscard]] std::vector<Reader> documentReaders();
[[nodiscard]] std::vector<Reader> grammarReaders();

/// A file of that name with these bytes, in a folder of this process, in memory where that can be.
[[nodiscard]] std::filesystem::path scratchFile(const std::string& name, std::string_view bytes);

/// Runs `job`. @return whether it went through; false when it was refused by a levelset::Error
template <typename Job>
bool accepts(const Job& job);

/// What must hold of what was read; says so and aborts otherwise, with or without NDEBUG.
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
