// Reads the seeds of the fuzzers and the inputs that they found once more. Needs no clang.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <string>

#include "tests/fuzz/readers.h"

namespace fuzz_test {

namespace fs = std::filesystem;

std::string contentOf(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class FuzzCorpus : public testing::TestWithParam<fuzz::Reader> {};

TEST_P(FuzzCorpus, IsReadOrRefused) {
  const fs::path folder = fs::path(LEVELSMITH_FUZZ_CORPUS) / GetParam().name;
  ASSERT_TRUE(fs::is_directory(folder)) << "no seeds for this reader";
  std::size_t count = 0;
  for (const auto& file : fs::directory_iterator(folder)) {
    SCOPED_TRACE(file.path().string());
    EXPECT_NO_THROW(GetParam().read(contentOf(file.path())));
    ++count;
  }
  EXPECT_GT(count, 0u);
}

TEST_P(FuzzCorpus, IsReadOrRefusedWhereverItIsTruncated) {
  const fs::path folder = fs::path(LEVELSMITH_FUZZ_CORPUS) / GetParam().name;
  for (const auto& file : fs::directory_iterator(folder)) {
    const std::string whole = contentOf(file.path());
    for (const std::size_t share : {1, 3, 7}) {
      SCOPED_TRACE(file.path().string() + ", " + std::to_string(share) + "/8");
      EXPECT_NO_THROW(GetParam().read(whole.substr(0, whole.size() * share / 8)));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Readers, FuzzCorpus, testing::ValuesIn(fuzz::readers()),
                         [](const auto& of) { return std::string(of.param.name); });

/// Inputs that revealed a defect and still take long. They are no seeds, because the fuzzer would
/// try little else.
TEST(FuzzReaders, ReadOrRefuseCostlyInputs) {
  for (const auto& folder : fs::directory_iterator(LEVELSMITH_FUZZ_COSTLY)) {
    const fuzz::Reader* reader = fuzz::findReader(folder.path().filename().string());
    ASSERT_NE(reader, nullptr) << folder.path();
    for (const auto& file : fs::directory_iterator(folder.path()))
      EXPECT_NO_THROW(reader->read(contentOf(file.path()))) << file.path();
  }
}

TEST(FuzzReaders, HaveSeedsOfTheirOwn) {
  std::set<std::string> folders, names;
  for (const auto& entry : fs::directory_iterator(LEVELSMITH_FUZZ_CORPUS))
    if (entry.is_directory()) folders.insert(entry.path().filename());
  for (const fuzz::Reader& reader : fuzz::readers()) names.insert(reader.name);
  EXPECT_EQ(folders, names);
}

// === Inputs that no seed of a few kB covers

TEST(FuzzDepth, NestedListsAreRefusedBeforeStackOverflow) {
  constexpr std::size_t kDeep = 1 << 20;
  const std::string lists = std::string(kDeep, '[') + std::string(kDeep, ']');
  const std::pair<const char*, std::string> documents[] = {
      {"graph", R"({"format": "levelsmith graph", "version": 1, "nodes": )" + lists + "}"},
      {"graph", R"({"format": )" + lists + "}"},
      {"patch", R"({"format": "levelsmith patches", "version": 1, "patches": )" + lists + "}"},
      {"lattice", R"({"format": "levelsmith lattice", "version": 1, "points": )" + lists + "}"},
      {"bezier",
       R"({"format": "levelsmith bezier volume", "version": 1, "patches": )" + lists + "}"},
      {"quadrics", R"({"format": "levelsmith quadrics", "version": 1, "quadrics": )" + lists + "}"},
      {"scene", R"({"format": "levelsmith scene", "version": 1, "solids": )" + lists + "}"},
      {"cache", R"({"version": 1, "action": )" + lists + "}"}};
  for (const auto& [name, text] : documents)
    EXPECT_NO_THROW(fuzz::findReader(name)->read(text)) << name;
}

TEST(FuzzDepth, NestedLoopsAreRefused) {
  std::string text;
  for (int i = 0; i < 100'000; ++i) text += "repeat 1\n";
  text += "box\n";
  for (int i = 0; i < 100'000; ++i) text += "end\n";
  EXPECT_NO_THROW(fuzz::findReader("script")->read(text));
}

TEST(FuzzDepth, LongFormulasAreRefused) {
  const std::string brackets = std::string(100'000, '(') + "x" + std::string(100'000, ')');
  EXPECT_NO_THROW(fuzz::findReader("formula")->read(brackets));
  EXPECT_NO_THROW(fuzz::findReader("formula")->read(std::string(100'000, '-') + "x"));
}

}  // namespace fuzz_test
