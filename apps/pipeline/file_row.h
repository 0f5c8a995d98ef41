#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace pipeline {

/// A row of files whose names differ by their number: '#'s stand for it, with that many digits
/// (step_###.vdb).
class FileRow {
 public:
  explicit FileRow(std::string pattern) : pattern_(std::move(pattern)) {}
  [[nodiscard]] bool hasNumber() const { return pattern_.find('#') != std::string::npos; }
  [[nodiscard]] const std::string& pattern() const { return pattern_; }
  /// @pre hasNumber()
  [[nodiscard]] std::filesystem::path file(std::size_t number) const;

 private:
  std::string pattern_;
};

}  // namespace pipeline
