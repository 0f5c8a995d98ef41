// Entry point for libFuzzer. `--reader=NAME` chooses the reader; libFuzzer ignores this option. A
// single program links in the time that each of many programs would take.

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
  // One thread makes a crash belong to the current input, and makes it reproducible.
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
  // Any other exception, bad_alloc included, propagates, and libFuzzer reports it as a crash.
  chosen->read({reinterpret_cast<const char*>(data), size});
  return 0;
}
