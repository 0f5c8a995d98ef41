#pragma once

// Private to the views: JSON files of shapes, as Bézier volumes and quadrics.

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace render {

using ShapeJson = nlohmann::ordered_json;

/// Reads the members of a document. Its errors end with a reference to the documentation.
struct ShapeDocument {
  const char* format;  ///< value of the member "format"
  const char* noun;    ///< object of the format, for messages: "a Bézier volume"
  const char* help;    ///< last part of messages
  static constexpr int kVersion = 1;

  [[noreturn]] void refuse(const std::string& what) const;
  [[nodiscard]] const ShapeJson& member(const ShapeJson& json, const char* name) const;
  /// @param noun  the object, for messages: "a patch"
  void requireKnown(const ShapeJson& json, const std::vector<std::string>& known,
                    const char* noun) const;
  [[nodiscard]] double number(const ShapeJson& value, const char* where) const;
  [[nodiscard]] std::vector<double> numbers(const ShapeJson& list, const char* where) const;
  /// Parses a text, and checks its format and version.
  [[nodiscard]] ShapeJson parsed(const std::string& text) const;
  /// Returns true if a file is a JSON document of this format.
  [[nodiscard]] bool isIn(const std::filesystem::path& file) const;
};

/// Writes a document to a file. @throws levelset::IoError if the file cannot be written
void writeShapeJson(const std::filesystem::path& file, const ShapeJson& json);

}  // namespace render
