#include "levelset/segmented/meshing/measure_segmented.h"

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

namespace levelset {

using Imath::V3d;

namespace {

/// Length of the junction curves. A strip between two of them adds its length once too often: half
/// of its border on junctions, less half of its border on other triangles.
double lengthOfJunctions(const SegmentedMesh& segmented) {
  using Edge = std::pair<std::uint32_t, std::uint32_t>;
  const auto lengthOf = [&](const Edge& edge) {
    return (segmented.mesh.positions[edge.first] - segmented.mesh.positions[edge.second]).length();
  };
  double sum = 0;
  std::vector<Edge> junctions;
  for (const JunctionEdge& edge : segmented.junctions) {
    sum += lengthOf({edge.vertices[0], edge.vertices[1]});
    if (!segmented.strips.empty())
      junctions.push_back(std::minmax(edge.vertices[0], edge.vertices[1]));
  }
  std::sort(junctions.begin(), junctions.end());
  std::vector<Edge> borders;
  for (const std::uint32_t t : segmented.strips)
    for (std::size_t k = 0; k < 3; ++k)
      borders.push_back(
          std::minmax(segmented.mesh.triangles[t][k], segmented.mesh.triangles[t][(k + 1) % 3]));
  std::sort(borders.begin(), borders.end());
  for (auto first = borders.begin(), last = first; first != borders.end(); first = last) {
    last = std::find_if(first, borders.end(), [&](const Edge& edge) { return edge != *first; });
    if (std::binary_search(junctions.begin(), junctions.end(), *first))
      sum -= lengthOf(*first) * static_cast<double>(last - first) / 2;
    else if (last - first == 1)
      sum += lengthOf(*first) / 2;
  }
  return sum;
}

}  // namespace

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
  auto strip = segmented.strips.begin();
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (strip != segmented.strips.end() && *strip == t) {
      ++strip;
      continue;
    }
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
  result.junctionLength = lengthOfJunctions(segmented);
  for (const auto& [a, b] : segmented.rims)
    result.rimLength += (mesh.positions[a] - mesh.positions[b]).length();
  return result;
}

SegmentedMeasurement measureSegmented(const SegmentedField& field,
                                      const SegmentedMeshOptions& options) {
  return measureSegmented(segmentedToMesh(field, options));
}

}  // namespace levelset
