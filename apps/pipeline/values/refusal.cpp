#include "apps/pipeline/values/refusal.h"

#include <string_view>
#include <system_error>

namespace pipeline {

std::string sentenceOf(const std::string& who, std::string sentence) {
  if (sentence.starts_with(who + ":")) return sentence;
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
  levelset::rethrow(error, withLocation(sentenceOf(who, error.what()), location));
}

}  // namespace pipeline
