#include "apps/pipeline/values/refusal.h"

#include <string_view>
#include <system_error>

namespace pipeline {

std::string sentenceOf(const std::string& who, std::string sentence) {
  if (sentence.starts_with(who + ":")) return sentence;
  // These prefixes name internal functions, not an action that the user wrote.
  for (const std::string helper : {"read: ", "write: ", "levelsmith: "}) {
    if (!sentence.starts_with(helper)) continue;
    sentence.erase(0, helper.size());
    break;
  }
  return who + ": " + sentence;
}

bool isThreadLimitError(const std::exception& error) {
  const auto* system = dynamic_cast<const std::system_error*>(&error);
  if (system) return system->code() == std::errc::resource_unavailable_try_again;
  return std::string_view(error.what()).starts_with("pthread_create");
}

std::string withLocation(const std::string& sentence, const std::string& location) {
  return location.empty() ? sentence : sentence + " (" + location + ")";
}

void rethrowAs(const std::string& who, const levelset::Error& error, const std::string& location) {
  using levelset::ExitCode;
  const std::string sentence = withLocation(sentenceOf(who, error.what()), location);
  switch (error.exitCode()) {
    case ExitCode::Usage:
      throw levelset::UsageError(sentence);
    case ExitCode::Resource:
      throw levelset::ResourceLimit(sentence);
    case ExitCode::Numeric:
      throw levelset::NumericalError(sentence);
    case ExitCode::File:
      throw levelset::IoError(sentence);
    case ExitCode::Interrupted:
      throw levelset::Cancelled(sentence);
    case ExitCode::Input:
    case ExitCode::Done:
      break;
  }
  throw levelset::InvalidInput(sentence);
}

}  // namespace pipeline
