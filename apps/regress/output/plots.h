#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace regress {

struct Plots {
  std::vector<std::string> names;  ///< plots; each exists as NAME.png and NAME.svg
  std::vector<std::string> notes;  ///< reasons why plots are missing
};

/// Writes plots.py into the folder of results.json and runs it. Users can run it again by hand.
[[nodiscard]] Plots makePlots(const std::filesystem::path& folder);

}  // namespace regress
