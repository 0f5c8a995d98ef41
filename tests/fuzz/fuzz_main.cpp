// libFuzzer's side: one program, the reader is chosen by `--reader=NAME`, which libFuzzer itself
// passes over. One program is linked in the time that each of many would take.

#include <oneapi/tbb/global_control.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>
#include <typeinfo>

#include "tests/fuzz/readers.h"

namespace {

const fuzz::Reader* chosen = nullptr;

[[noreturn]] void listReaders() {
  std::fprintf(stderr, "Name a reader by --reader=NAME, one of:");
  for (const fuzz::Reader& reader : fuzz::readers()) std::fprintf(stderr, " %s", reader.name);
  std::fprintf(stderr, "\n");
  std::exit(2);
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* count, char*** arguments) {
  // One thread: a crash is then of the input that is tried, and the same every time.
  static const oneapi::tbb::global_control single(
      oneapi::tbb::global_control::max_allowed_parallelism, 1);
  constexpr std::string_view kOption = "--reader=";
  for (int i = 1; i < *count; ++i) {
    const std::string_view argument = (*arguments)[i];
    if (argument.starts_with(kOption)) chosen = fuzz::findReader(argument.substr(kOption.size()));
  }
  if (!chosen) listReaders();
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // Any other exception leaves, and libFuzzer tells it as a crash: bad_alloc among them.
  chosen->read({reinterpret_cast<const char*>(data), size});
  return 0;
}
