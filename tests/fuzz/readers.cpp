#include "tests/fuzz/readers.h"

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>

namespace fuzz {
namespace {

namespace fs = std::filesystem;

/// Temporary folder, in memory if possible, removed when the process ends.
class ScratchFolder {
 public:
  ScratchFolder() : owner_(::getpid()) {
    std::error_code error;
    const fs::path memory = "/dev/shm";
    const fs::path base =
        ::access(memory.c_str(), W_OK) == 0 ? memory : fs::temp_directory_path(error);
    std::string name = (base / "levelsmith-fuzz-XXXXXX").string();
    require(::mkdtemp(name.data()) != nullptr, "a scratch folder can be made");
    path_ = name;
  }
  ~ScratchFolder() {
    std::error_code error;
    if (owner_ == ::getpid()) fs::remove_all(path_, error);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
  pid_t owner_;
};

}  // namespace

const std::vector<Reader>& readers() {
  static const std::vector<Reader> all = [] {
    std::vector<Reader> list;
    for (const auto& part : {meshReaders(), gridReaders(), volumeReaders(), pointReaders(),
                             pictureReaders(), documentReaders(), grammarReaders()})
      list.insert(list.end(), part.begin(), part.end());
    return list;
  }();
  return all;
}

const Reader* findReader(std::string_view name) {
  for (const Reader& reader : readers())
    if (reader.name == name) return &reader;
  return nullptr;
}

fs::path scratchFile(const std::string& name, std::string_view bytes) {
  static const ScratchFolder folder;
  fs::path file = folder.path() / name;
  std::ofstream out(file, std::ios::binary);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  require(out.good(), "a scratch file can be written");
  return file;
}

void require(bool isTrue, const char* what) {
  if (isTrue) return;
  std::fprintf(stderr, "This does not hold: %s\n", what);
  std::abort();
}

}  // namespace fuzz
