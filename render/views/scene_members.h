#pragma once

// Internal header of render: public headers must not include it.

#include <numbers>
#include <string>
#include <vector>

#include "levelset/progress.h"
#include "render/scene/scene.h"

/// Parts that reading and writing a scene file share.
namespace render::scene_file {

inline constexpr const char* kFormat = "levelsmith scene";
inline constexpr int kVersion = 1;
inline constexpr double kDegree = std::numbers::pi / 180;

[[nodiscard]] std::vector<std::string> solidNames(const Scene& scene);
/// Names of the operands of an expression, by their numbers: solids, then Bézier volumes.
[[nodiscard]] std::vector<std::string> operandNames(const Scene& scene);

/// @throws levelset::UsageError for names of parts that requireSceneNames() refuses
void requireNames(const Scene& scene);

/// Divides the progress range evenly among files that are read or written one after the other.
class Parts {
 public:
  Parts(const levelset::Progress& progress, std::size_t count)
      : progress_(progress), count_(static_cast<double>(count)) {}
  [[nodiscard]] levelset::Progress next() {
    const double first = done_++;
    return levelset::subProgress(progress_, first / count_, done_ / count_);
  }

 private:
  const levelset::Progress& progress_;
  double count_, done_ = 0;
};

}  // namespace render::scene_file
