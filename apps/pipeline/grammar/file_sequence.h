#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace pipeline {

/// A sequence of numbered files in one folder, such as step_###.vdb. The first run of '#' in the
/// file name stands for the number, padded to that many digits. A '#' in a folder name is literal.
class FileSequence {
 public:
  explicit FileSequence(std::string pattern) : pattern_(std::move(pattern)) {}
  /// Decides if the file name contains a '#'.
  [[nodiscard]] bool hasNumber() const { return numberPosition() != std::string::npos; }
  [[nodiscard]] const std::string& pattern() const { return pattern_; }
  /// Path of one file of the sequence.
  /// @pre hasNumber()
  [[nodiscard]] std::filesystem::path file(std::size_t number) const;

 private:
  [[nodiscard]] std::size_t numberPosition() const;
  std::string pattern_;
};

}  // namespace pipeline
