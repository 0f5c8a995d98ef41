#include "apps/pipeline/operators/terrain/terrain_figures.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "levelset/terrain/ground_slope.h"
#include "levelset/terrain/measure_ground.h"

namespace pipeline {

bool isTerrain(const Invocation& in) {
  return !in.operands.empty() && in.operands[0].kind() == Kind::Terrain;
}

Value measureTerrain(Invocation& in) {
  const levelset::HeightField& terrain = in.operands[0].terrain();
  const double plane = in.given("above") ? in.number("above") : 0;
  const levelset::GroundMeasures m = levelset::measureGround(
      terrain, {.height = plane}, levelset::subProgress(in.progress, 0, 0.4));
  const levelset::HeightField slopes =
      levelset::slopeDegrees(terrain, {.edges = true,
                                       .maxMemory = in.maxMemory,
                                       .progress = levelset::subProgress(in.progress, 0.4, 1)});
  double sum = 0, steepest = 0;
  std::size_t count = 0;
  for (const float slope : slopes.heights) {
    if (std::isnan(slope)) continue;
    sum += static_cast<double>(slope);
    steepest = std::max(steepest, static_cast<double>(slope));
    ++count;
  }
  const auto orNull = [](bool isKnown, double number) { return isKnown ? Json(number) : Json(); };
  Json json;
  json["area"] = m.area;
  json["projected_area"] = m.projectedArea;
  json["plane"] = plane;
  json["volume_above"] = m.volumeAbove;
  json["volume_below"] = m.volumeBelow;
  json["mean_height"] = orNull(m.triangles > 0, m.meanHeight);
  json["lowest"] = orNull(m.missing < terrain.heights.size(), m.lowest);
  json["highest"] = orNull(m.missing < terrain.heights.size(), m.highest);
  json["mean_slope"] = orNull(count > 0, count > 0 ? sum / static_cast<double>(count) : 0);
  json["steepest_slope"] = orNull(count > 0, steepest);
  json["triangles"] = m.triangles;
  json["missing"] = m.missing;
  in.notes.detailsJson = json.dump();
  if (asksJson(in)) {
    in.output = printed(json);
  } else {
    for (const auto& [key, entry] : json.items())
      in.output += fmt::format(
          "{:<22}{}\n", key,
          entry.is_number_float() ? fmt::format("{:.9g}", entry.get<double>()) : entry.dump());
  }
  return in.operands[0];
}

void addTerrain(Json& json, const levelset::HeightField& terrain) {
  json["columns"] = terrain.columns;
  json["rows"] = terrain.rows;
  json["origin"] = Json::array({terrain.origin.x, terrain.origin.y});
  json["spacing"] = Json::array({terrain.spacing.x, terrain.spacing.y});
  const Imath::Box3d bounds = terrain.bounds();
  json["range"] = bounds.isEmpty() ? Json() : Json::array({bounds.min.z, bounds.max.z});
  json["missing"] = terrain.missingCount();
  if (!terrain.coordinateSystem.empty()) json["coordinate_system"] = terrain.coordinateSystem;
  json["geographic"] = terrain.isGeographic;
  json["bytes"] = terrain.memoryUse();
  json["hash"] = fmt::format("{:016x}", terrain.contentHash());
}

}  // namespace pipeline
