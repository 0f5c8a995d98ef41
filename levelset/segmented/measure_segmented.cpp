#include "levelset/segmented/measure_segmented.h"

#include <map>
#include <utility>

namespace levelset {

using Imath::V3d;

SegmentedMeasurement measureSegmented(const SegmentedMesh& segmented) {
  SegmentedMeasurement result;
  const TriMesh& mesh = segmented.mesh;
  result.triangles = mesh.triangles.size();
  result.junctionPoints = segmented.junctionPoints.size();
  // Relative to the centre of each region, volumes keep their digits far from the origin.
  std::map<RegionLabel, RegionMeasure> regions;
  regions[kVoid].label = kVoid;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const RegionLabel label : {segmented.sides[t].behind, segmented.sides[t].front}) {
      RegionMeasure& region = regions[label];
      region.label = label;
      for (const std::uint32_t v : mesh.triangles[t]) region.bounds.extendBy(mesh.positions[v]);
    }
  std::map<std::pair<RegionLabel, RegionLabel>, InterfaceMeasure> interfaces;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [behind, front] = segmented.sides[t];
    const V3d &a = mesh.positions[mesh.triangles[t][0]], &b = mesh.positions[mesh.triangles[t][1]],
              &c = mesh.positions[mesh.triangles[t][2]];
    const double area = (b - a).cross(c - a).length() / 2;
    const auto add = [&](RegionLabel label, double sign) {
      RegionMeasure& region = regions[label];
      region.area += area;
      ++region.triangles;
      if (label == kVoid) return;
      const V3d centre = region.bounds.center();
      region.volume += sign * ((a - centre).cross(b - centre) ^ (c - centre)) / 6;
    };
    if (behind == front) {
      regions[front].sheetArea += area;
      ++regions[front].triangles;
    } else {
      add(behind, 1);
      add(front, -1);
    }
    InterfaceMeasure& interface = interfaces[{front, behind}];
    interface.sides = segmented.sides[t];
    interface.area += area;
    ++interface.triangles;
  }
  for (const auto& [label, region] : regions) {
    result.regions.push_back(region);
    result.volume += region.volume;
  }
  for (const auto& [sides, interface] : interfaces) {
    result.interfaces.push_back(interface);
    result.area += interface.area;
  }
  for (const JunctionEdge& edge : segmented.junctions)
    result.junctionLength +=
        (mesh.positions[edge.vertices[0]] - mesh.positions[edge.vertices[1]]).length();
  for (const auto& [a, b] : segmented.rims)
    result.rimLength += (mesh.positions[a] - mesh.positions[b]).length();
  return result;
}

SegmentedMeasurement measureSegmented(const SegmentedField& field,
                                      const SegmentedMeshOptions& options) {
  return measureSegmented(segmentedToMesh(field, options));
}

}  // namespace levelset
