#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace pipeline {

/// A row of files of one folder whose names differ by their number: the first '#'s of the name
/// stand for it, with that many digits (step_###.vdb). Those of folders stand for themselves.
class FileSequence {
 public:
  explicit FileSequence(std::string pattern) : pattern_(std::move(pattern)) {}
  [[nodiscard]] bool hasNumber() const { return numberPosition() != std::string::npos; }
  [[nodiscard]] const std::string& pattern() const { return pattern_; }
  /// @pre hasNumber()
  [[nodiscard]] std::filesystem::path file(std::size_t number) const;

 private:
  [[nodiscard]] std::size_t numberPosition() const;
  std::string pattern_;
};

}  // namespace pipeline
