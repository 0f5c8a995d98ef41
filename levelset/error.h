#pragma once

#include <stdexcept>
#include <string>

/// Exception classes, one for each exit code of the command line. A message is one sentence. It
/// names the cause, the location and a remedy. It does not name the operator that throws it: the
/// caller knows the operator, and the command line puts the name of the action before the message.
namespace levelset {

enum class ExitCode : int {
  Done = 0,
  Usage = 2,     ///< wrong command line or argument: a negative length, a missing operand
  Input = 3,     ///< unusable data: a truncated file, an open mesh with `--sign closed`
  Resource = 4,  ///< memory, index range or image size exceeds its limit
  Numeric = 5,   ///< a numeric check failed
  File = 6,      ///< file missing, unreadable or not writable, or disk full
  Interrupted = 130
};

class Error : public std::runtime_error {
 public:
  Error(ExitCode code, const std::string& sentence) : std::runtime_error(sentence), code_(code) {}
  [[nodiscard]] ExitCode exitCode() const { return code_; }

 private:
  ExitCode code_;
};

struct UsageError : Error {
  explicit UsageError(const std::string& sentence) : Error(ExitCode::Usage, sentence) {}
};
struct InvalidInput : Error {
  explicit InvalidInput(const std::string& sentence) : Error(ExitCode::Input, sentence) {}
};
/// A result has no surface. It is an error for a complete solid, but not for a part of one.
struct NoSurface : InvalidInput {
  using InvalidInput::InvalidInput;
};
struct ResourceLimit : Error {
  explicit ResourceLimit(const std::string& sentence) : Error(ExitCode::Resource, sentence) {}
};
struct NumericalError : Error {
  explicit NumericalError(const std::string& sentence) : Error(ExitCode::Numeric, sentence) {}
};
struct IoError : Error {
  explicit IoError(const std::string& sentence) : Error(ExitCode::File, sentence) {}
};
struct Cancelled : Error {
  explicit Cancelled(const std::string& sentence) : Error(ExitCode::Interrupted, sentence) {}
};

/// Throws an error of the same class with another message.
[[noreturn]] inline void rethrow(const Error& error, const std::string& message) {
  switch (error.exitCode()) {
    case ExitCode::Usage:
      throw UsageError(message);
    case ExitCode::Resource:
      throw ResourceLimit(message);
    case ExitCode::Numeric:
      throw NumericalError(message);
    case ExitCode::File:
      throw IoError(message);
    case ExitCode::Interrupted:
      throw Cancelled(message);
    case ExitCode::Input:
    case ExitCode::Done:
      break;
  }
  if (dynamic_cast<const NoSurface*>(&error)) throw NoSurface(message);
  throw InvalidInput(message);
}

/// Returns the result of `work`. Puts "context: " before the message of an Error that `work`
/// throws.
template <class Work>
auto withContext(const std::string& context, const Work& work) -> decltype(work()) {
  try {
    return work();
  } catch (const Error& error) {
    rethrow(error, context + ": " + error.what());
  }
}

}  // namespace levelset
