#include "apps/pipeline/operators/solids/sheet_report.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <vector>

namespace pipeline {

using levelset::RegionLabel;

void reportSheets(const levelset::SegmentMeshResult& result, Invocation& in) {
  const std::vector<RegionLabel> owners = result.field.sheetLabels();
  in.notes.notes.push_back(
      owners.empty() ? std::string("the mesh has no sheets: each triangle separates two regions")
                     : fmt::format("sheets lie inside region{} {}; 0 is the void",
                                   owners.size() == 1 ? "" : "s", fmt::join(owners, ", ")));
  if (result.crossingTriangles > 0)
    in.notes.notes.push_back(
        fmt::format("{} triangles cross others without sharing edges; the lines where they meet "
                    "became junctions",
                    result.crossingTriangles));
  Json thin = Json::array();
  for (const levelset::ThinPart& part : result.thinParts) {
    const Imath::V3d& p = part.position;
    thin.push_back({{"label", part.label},
                    {"places", part.places},
                    {"lost", part.isLost},
                    {"thickness", part.thickness},
                    {"position", {p.x, p.y, p.z}}});
    in.notes.warnings.push_back(fmt::format(
        "surfaces in region {} are less than a voxel apart along {} line{} of the grid, {:.3g} at "
        "{:.4g},{:.4g},{:.4g}{}; use a smaller --voxel",
        part.label, part.places, part.places == 1 ? "" : "s", part.thickness, p.x, p.y, p.z,
        part.isLost ? ", and became one surface where no grid point lies between them" : ""));
  }
  in.notes.certificateJson = Json{
      {"labels", result.field.labels()},
      {"sheets", owners},
      {"rim_edges", result.rimEdges},
      {"crossing_triangles", result.crossingTriangles},
      {"thin", thin}}.dump();
}

void noteLostSheets(const levelset::SegmentedField& field, RegionLabel label, const char* action,
                    StepNotes& notes) {
  const std::vector<RegionLabel> owners = field.sheetLabels();
  if (std::binary_search(owners.begin(), owners.end(), label))
    notes.notes.push_back(fmt::format(
        "region {} has sheets inside, which {} leaves out; 'mesh' without --label keeps them",
        label, action));
}

void addSheetFigures(const levelset::SegmentedField& field,
                     const levelset::SegmentedMeasurement& measured, Json& json) {
  if (field.sheetLabels().empty()) return;
  double area = 0;
  std::size_t material = 0;
  for (const levelset::RegionMeasure& region : measured.regions) {
    area += region.sheetArea;
    if (region.label != levelset::kVoid)
      json["materials"][material++]["sheet_area"] = region.sheetArea;
  }
  json["sheet_area"] = area;
  json["rim_length"] = measured.rimLength;
}

}  // namespace pipeline
