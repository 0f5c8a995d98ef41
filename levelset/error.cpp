#include "levelset/error.h"

namespace levelset {

void rethrow(const Error& error, const std::string& message) {
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
  throw InvalidInput(message);
}

}  // namespace levelset
