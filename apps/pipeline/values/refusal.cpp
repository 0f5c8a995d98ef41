#include "apps/pipeline/values/refusal.h"

#include <string_view>
#include <system_error>

namespace pipeline {

std::string sentenceOf(const std::string& who, std::string sentence) {
  if (sentence.starts_with(who + ":")) return sentence;
  // Whoever reads or writes for an action is no action that the user knows of.
  for (const std::string helper : {"read: ", "write: ", "levelsmith: "}) {
    if (!sentence.starts_with(helper)) continue;
    sentence.erase(0, helper.size());
    break;
  }
  return who + ": " + sentence;
}

bool isWantOfThreads(const std::exception& error) {
  const auto* system = dynamic_cast<const std::system_error*>(&error);
  if (system) return system->code() == std::errc::resource_unavailable_try_again;
  return std::string_view(error.what()).starts_with("pthread_create");
}

std::string withPlace(const std::string& sentence, const std::string& place) {
  return place.empty() ? sentence : sentence + " (" + place + ")";
}

void refuseAs(const std::string& who, const levelset::Error& error, const std::string& place) {
  using levelset::ExitCode;
  const std::string sentence = withPlace(sentenceOf(who, error.what()), place);
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
