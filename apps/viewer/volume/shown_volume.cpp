#include "apps/viewer/volume/shown_volume.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <numeric>
#include <utility>

#include "apps/pipeline/values/units.h"
#include "apps/viewer/text/point_text.h"
#include "levelset/error.h"

namespace viewer {
namespace {

double firstIsovalueOf(const levelset::VolumeHistogram& histogram) {
  return asWritten(histogram.otsu.empty() ? (histogram.low + histogram.high) / 2
                                          : histogram.otsu.front());
}

std::string surfaceOptions(const IsosurfaceView& view) {
  std::string text;
  if (view.filter != render::Filter::Trilinear)
    text += fmt::format(" --filter {}", render::filterName(view.filter));
  if (view.inside == render::VolumeInside::Below) text += " --inside below";
  return text;
}

/// A copy of a volume in memory. Another program may change or shorten a mapped file at any time.
levelset::Volume copied(const levelset::Volume& volume) {
  const auto numbers = std::make_shared<const std::vector<char>>(
      volume.numbers(), volume.numbers() + volume.memoryUse());
  return {
      volume.grid(), volume.type(), volume.scale(), {.owner = numbers, .begin = numbers->data()}};
}

}  // namespace

ShownVolume shownVolume(levelset::Volume volume, const levelset::Progress& progress) {
  if (volume.isMapped()) volume = copied(volume);
  levelset::VolumeHistogram histogram =
      levelset::histogram(volume, {.progress = levelset::subProgress(progress, 0, 0.5)});
  const double isovalue = firstIsovalueOf(histogram);
  return {render::VolumeSurface(std::move(volume), isovalue, render::VolumeInside::Above,
                                levelset::subProgress(progress, 0.5, 1)),
          std::move(histogram)};
}

IsosurfaceView firstIsosurface(const ShownVolume& volume) {
  return {.isovalue = volume.surface.isovalue()};
}

SliceView firstSlices(const ShownVolume& volume) {
  const levelset::VolumeHistogram& histogram = volume.histogram;
  const auto all =
      std::accumulate(histogram.counts.begin(), histogram.counts.end(), std::uint64_t{0});
  const double few = 0.005 * static_cast<double>(all);
  SliceView slices{.black = histogram.low, .white = histogram.high};
  std::uint64_t below = 0;
  bool hasBlack = false;
  for (std::size_t bin = 0; bin < histogram.counts.size(); ++bin) {
    below += histogram.counts[bin];
    if (!hasBlack && static_cast<double>(below) > few) {
      slices.black = asWritten(histogram.center(bin));
      hasBlack = true;
    }
    if (static_cast<double>(all - below) > few) continue;
    slices.white = asWritten(histogram.center(bin));
    break;
  }
  if (!(slices.white > slices.black)) {
    slices.black = histogram.low;
    slices.white = histogram.high;
  }
  return slices;
}

render::DirectVolume directVolume(const ShownVolume& volume, const LightView& view) {
  return {volume.surface, view.transfer};
}

void placeIsosurface(const ShownVolume& volume, const IsosurfaceView& view, render::Scene& scene) {
  if (!view.isShown) {
    scene.solids.clear();
    return;
  }
  scene.solids.front().volume = std::make_shared<const render::VolumeSurface>(
      volume.surface.withIsovalue(view.isovalue, view.inside));
}

std::array<std::optional<double>, 3> parseSlices(const std::string& text) {
  std::array<std::optional<double>, 3> slices;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find(',', at), text.size());
    const std::string part = text.substr(at, end - at);
    at = end + 1;
    const std::string axes = "ijk";
    const std::size_t axis = part.size() > 2 && part[1] == '=' ? axes.find(part[0]) : axes.npos;
    if (axis == axes.npos || slices[axis])
      throw levelset::UsageError(
          fmt::format("levelsmith-view: --slices '{}' names no slices; give at most one position "
                      "for each axis of the grid, for example i=90,k=60.5",
                      text));
    slices[axis] = pipeline::parseNumber(part.substr(2), "levelsmith-view: --slices");
  }
  return slices;
}

std::string isosurfaceText(const IsosurfaceView& view) {
  return fmt::format("isosurface {:.8g}{}", view.isovalue, surfaceOptions(view));
}

std::string lightText(const LightView& view, const IsosurfaceView& isosurface) {
  std::string text = fmt::format("--transfer \"{}\"", render::transferText(view.transfer));
  if (!view.isShaded) text += " --no-shading";
  if (isosurface.isShown)
    text += fmt::format(" --isovalue {:.8g}{}", isosurface.isovalue, surfaceOptions(isosurface));
  return text;
}

}  // namespace viewer
