#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace regress {

struct Plots {
  std::vector<std::string> names;  ///< each is there as NAME.png and NAME.svg
  std::vector<std::string> notes;  ///< why there are none
};

/// Puts plots.py beside results.json and runs it; it can be run again by hand.
[[nodiscard]] Plots makePlots(const std::filesystem::path& folder);

}  // namespace regress
