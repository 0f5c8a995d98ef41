#include "apps/pipeline/values/value.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "levelset/adaptive/adaptive_to_mesh.h"
#include "levelset/deform/cage/cage.h"
#include "levelset/error.h"
#include "levelset/geometry/vertex_normals.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/segmented/meshing/segmented_to_mesh.h"

namespace pipeline {

using levelset::NarrowBand;
using levelset::TriMesh;

const char* kindName(Kind kind) {
  switch (kind) {
    case Kind::Mesh:
      return "mesh";
    case Kind::Band:
      return "level set";
    case Kind::Patch:
      return "patch";
    case Kind::Field:
      return "field";
    case Kind::Surface:
      return "surface band";
    case Kind::Scene:
      return "scene";
    case Kind::Volume:
      return "volume";
    case Kind::Points:
      return "point cloud";
    case Kind::Adaptive:
      return "adaptive field";
    case Kind::Segmentation:
      return "segmentation";
    case Kind::Molecule:
      return "molecule";
    case Kind::Terrain:
      return "terrain";
    case Kind::Deformation:
      return "deformation";
  }
  return "";
}

std::string kindPhrase(Kind kind) {
  return fmt::format("{} {}", kind == Kind::Adaptive ? "an" : "a", kindName(kind));
}

levelset::ValuePlan Plan::estimate() const {
  return {.bounds = bounds,
          .area = area,
          .voxelSize = voxelSize,
          .halfWidth = halfWidth,
          .triangles = triangles,
          .fieldBytes = fieldBytes};
}

void Plan::set(const levelset::ValuePlan& estimate) {
  bounds = estimate.bounds;
  area = estimate.area;
  voxelSize = estimate.voxelSize;
  halfWidth = estimate.halfWidth;
  triangles = estimate.triangles;
  fieldBytes = estimate.fieldBytes;
}

double Plan::activeVoxels() const {
  return voxelSize > 0 ? estimate().activeVoxels() : 0;
}

double Plan::bytes() const {
  if (kind == Kind::Field || kind == Kind::Volume || kind == Kind::Adaptive ||
      kind == Kind::Segmentation || kind == Kind::Terrain)
    return fieldBytes;
  if (kind == Kind::Points || kind == Kind::Molecule) return points * pointBytes;
  // Three vertex indices for each triangle, and one position for every two triangles.
  if (kind == Kind::Mesh) return (3 * sizeof(std::uint32_t) + sizeof(Imath::V3d) / 2.0) * triangles;
  return levelset::kBytesPerVoxel * activeVoxels();
}

double bytesPerPoint(const levelset::PointCloud& cloud) {
  double bytes = sizeof(cloud.positions[0]);
  if (!cloud.normals.empty()) bytes += sizeof(cloud.normals[0]);
  if (!cloud.colors.empty()) bytes += sizeof(cloud.colors[0]);
  if (!cloud.radii.empty()) bytes += sizeof(cloud.radii[0]);
  if (!cloud.weights.empty()) bytes += sizeof(cloud.weights[0]);
  return bytes;
}

Plan planOf(const levelset::VolumeGrid& grid, levelset::VolumeType type) {
  Plan plan{.kind = Kind::Volume, .bounds = grid.bounds()};
  const Imath::V3d spacing = grid.spacing();
  plan.voxelSize = std::min({spacing.x, spacing.y, spacing.z});
  if (grid.size.z == 1) plan.samples = {grid.size.x, grid.size.y};
  plan.fieldBytes = static_cast<double>(grid.size.x) * grid.size.y * grid.size.z *
                    static_cast<double>(levelset::volumeTypeSize(type));
  return plan;
}

Value::Value(TriMesh mesh) : data_(std::make_shared<const TriMesh>(std::move(mesh))) {}
Value::Value(NarrowBand band) : data_(std::move(band)) {}
Value::Value(PatchValue patch) : data_(std::make_shared<const PatchValue>(std::move(patch))) {}
Value::Value(levelset::FieldGrid field) : data_(std::move(field)) {}
Value::Value(render::ViewedScene scene)
    : data_(std::make_shared<const render::ViewedScene>(std::move(scene))) {}
Value::Value(levelset::Volume volume)
    : data_(std::make_shared<const levelset::Volume>(std::move(volume))) {}
Value::Value(levelset::PointCloud cloud)
    : data_(std::make_shared<const levelset::PointCloud>(std::move(cloud))) {}
Value::Value(levelset::AdaptiveField field) : data_(std::move(field)) {}
Value::Value(levelset::SegmentedField field) : data_(std::move(field)) {}
Value::Value(levelset::Molecule molecule)
    : data_(std::make_shared<const levelset::Molecule>(std::move(molecule))) {}
Value::Value(levelset::HeightField terrain)
    : data_(std::shared_ptr<const levelset::HeightField>(
          std::make_shared<levelset::HeightField>(std::move(terrain)))) {}
Value::Value(DeformationValue deformation) : data_(std::move(deformation)) {}
Value::Value(Plan plan) : plan_(plan) {}

Kind Value::kind() const {
  switch (data_.index()) {
    case 1:
      return Kind::Mesh;
    case 2:
      return std::get<NarrowBand>(data_).isOpenSurface() ? Kind::Surface : Kind::Band;
    case 3:
      return Kind::Patch;
    case 4:
      return Kind::Field;
    case 5:
      return Kind::Scene;
    case 6:
      return Kind::Volume;
    case 7:
      return Kind::Points;
    case 8:
      return Kind::Adaptive;
    case 9:
      return Kind::Segmentation;
    case 10:
      return Kind::Molecule;
    case 11:
      return Kind::Terrain;
    case 12:
      return Kind::Deformation;
    default:
      return plan_->kind;
  }
}

template <typename T>
const T& Value::as(Kind wanted) const {
  if (const T* value = std::get_if<T>(&data_)) return *value;
  throw levelset::UsageError(
      fmt::format("the value is {}, but {} is needed; choose "
                  "another operand, or another grid of the file",
                  kindPhrase(kind()), kindPhrase(wanted)));
}

const TriMesh& Value::mesh() const {
  return *as<std::shared_ptr<const TriMesh>>(Kind::Mesh);
}
const NarrowBand& Value::band() const {
  return as<NarrowBand>(Kind::Band);
}
const PatchValue& Value::patch() const {
  return *as<std::shared_ptr<const PatchValue>>(Kind::Patch);
}
const levelset::FieldGrid& Value::field() const {
  return as<levelset::FieldGrid>(Kind::Field);
}

const render::ViewedScene& Value::scene() const {
  return *as<std::shared_ptr<const render::ViewedScene>>(Kind::Scene);
}

const levelset::Volume& Value::volume() const {
  return *as<std::shared_ptr<const levelset::Volume>>(Kind::Volume);
}

const levelset::PointCloud& Value::cloud() const {
  return *as<std::shared_ptr<const levelset::PointCloud>>(Kind::Points);
}

const levelset::AdaptiveField& Value::adaptive() const {
  return as<levelset::AdaptiveField>(Kind::Adaptive);
}

const levelset::SegmentedField& Value::segmentation() const {
  return as<levelset::SegmentedField>(Kind::Segmentation);
}

const levelset::Molecule& Value::molecule() const {
  return *as<std::shared_ptr<const levelset::Molecule>>(Kind::Molecule);
}

std::shared_ptr<const levelset::HeightField> Value::sharedTerrain() const {
  return as<std::shared_ptr<const levelset::HeightField>>(Kind::Terrain);
}
levelset::HeightField Value::takeTerrain(std::size_t maxMemory) {
  (void)plan();  // lengths in voxels need it later
  std::shared_ptr<const levelset::HeightField> shared = sharedTerrain();
  data_ = std::make_shared<const levelset::HeightField>();
  // The constructor has made an object that is not const.
  if (shared.use_count() == 1)
    return std::move(*std::const_pointer_cast<levelset::HeightField>(shared));
  levelset::requireMemory(static_cast<double>(shared->memoryUse()),
                          levelset::memoryLeft(levelset::memoryLimit(maxMemory)));
  return *shared;
}
const levelset::HeightField& Value::terrain() const {
  return *as<std::shared_ptr<const levelset::HeightField>>(Kind::Terrain);
}

const DeformationValue& Value::deformation() const {
  return as<DeformationValue>(Kind::Deformation);
}

const levelset::ControlLattice* DeformationValue::lattice() const {
  const auto* lattice = dynamic_cast<const levelset::LatticeDeformation*>(map.get());
  return lattice ? &lattice->lattice() : nullptr;
}

std::size_t DeformationValue::controlPoints() const {
  if (const levelset::ControlLattice* of = lattice()) return of->data().points.size();
  return dynamic_cast<const levelset::CageDeformation&>(*map).rest().size();
}

const Plan& Value::plan() const {
  if (plan_) return *plan_;
  Plan plan;
  plan.kind = kind();
  switch (plan.kind) {
    case Kind::Mesh:
      plan.bounds = bounds(mesh());
      plan.area = surfaceArea(mesh());
      plan.triangles = static_cast<double>(mesh().triangles.size());
      break;
    case Kind::Band:
    case Kind::Surface:
      plan.bounds = band().zeroSetBounds();
      plan.voxelSize = band().voxelSize();
      plan.halfWidth = band().halfWidth();
      plan.area = static_cast<double>(band().activeVoxelCount()) * plan.voxelSize * plan.voxelSize /
                  (2 * plan.halfWidth);
      break;
    case Kind::Patch:
      for (const mapping::Patch& one : patch().patches)
        for (const mapping::ParticleLayer& layer : one.layers)
          for (const Imath::V3d& p : layer.positions) plan.bounds.extendBy(p);
      break;
    case Kind::Field:
      plan.bounds = field().bounds();
      plan.voxelSize = field().voxelSize();
      plan.fieldBytes = static_cast<double>(field().memoryUse());
      break;
    case Kind::Volume:
      plan = planOf(volume().grid(), volume().type());
      break;
    case Kind::Points:
      plan.bounds = bounds(cloud());
      plan.points = static_cast<double>(cloud().size());
      plan.pointBytes = bytesPerPoint(cloud());
      break;
    case Kind::Adaptive:
      plan.bounds = adaptive().zeroSetBounds();
      plan.fieldBytes = static_cast<double>(adaptive().memoryUse());
      break;
    case Kind::Segmentation:
      plan.bounds = segmentation().interfaceBounds();
      plan.voxelSize = segmentation().voxelSize();
      plan.halfWidth = segmentation().halfWidth();
      plan.area = static_cast<double>(segmentation().activeVoxelCount()) * plan.voxelSize *
                  plan.voxelSize / (2 * plan.halfWidth);
      plan.fieldBytes = static_cast<double>(segmentation().memoryUse());
      break;
    case Kind::Molecule:
      plan.bounds = molecule().bounds();
      plan.points = static_cast<double>(molecule().atoms.size());
      plan.pointBytes = sizeof(levelset::Atom);
      break;
    case Kind::Terrain:
      plan.bounds = terrain().bounds();
      plan.fieldBytes = static_cast<double>(terrain().memoryUse());
      plan.samples = {terrain().columns, terrain().rows};
      break;
    case Kind::Deformation:
      plan.bounds = deformation().map->bounds();
      break;
    case Kind::Scene:
      plan.bounds = scene().scene.bounds();
      plan.bounds.extendBy(scene().scene.volumeBounds());
      for (const render::Solid& solid : scene().scene.solids) {
        const double h = solid.band.voxelSize();
        plan.voxelSize = plan.voxelSize > 0 ? std::min(plan.voxelSize, h) : h;
        plan.halfWidth = solid.band.halfWidth();
        plan.area +=
            static_cast<double>(solid.band.activeVoxelCount()) * h * h / (2 * plan.halfWidth);
      }
      break;
  }
  plan_ = plan;
  return *plan_;
}

namespace {

/// Adds normals, so that facets are not seen. Creases stay sharp.
std::shared_ptr<const TriMesh> smoothMesh(TriMesh mesh) {
  constexpr double kCreaseAngle = 0.5;
  mesh.attributes.normals = levelset::vertexNormals(mesh, kCreaseAngle);
  return std::make_shared<const TriMesh>(std::move(mesh));
}

/// Makes a mesh of each region: the interfaces with void and regions of smaller labels.
std::vector<render::MeshPart> partsOf(const levelset::SegmentedField& field) {
  const levelset::SegmentedMesh all = levelset::segmentedToMesh(field);
  std::map<levelset::RegionLabel, std::vector<std::size_t>> regions;
  for (std::size_t t = 0; t < all.sides.size(); ++t) regions[all.sides[t].behind].push_back(t);
  std::vector<render::MeshPart> parts;
  for (const auto& [label, triangles] : regions) {
    TriMesh region;
    std::unordered_map<std::uint32_t, std::uint32_t> numbers;
    for (const std::size_t t : triangles) {
      auto& corners = region.triangles.emplace_back(all.mesh.triangles[t]);
      for (std::uint32_t& corner : corners) {
        const auto next = static_cast<std::uint32_t>(region.positions.size());
        const auto [number, isNew] = numbers.try_emplace(corner, next);
        if (isNew) region.positions.push_back(all.mesh.positions[corner]);
        corner = number->second;
      }
    }
    parts.push_back({.mesh = smoothMesh(std::move(region)),
                     .colour = render::regionColour(label),
                     .id = label,
                     .name = "region " + std::to_string(label)});
  }
  return parts;
}

}  // namespace

render::ViewedScene sceneOf(const Value& drawn) {
  render::ViewedScene viewed;
  if (drawn.kind() == Kind::Scene)
    viewed = drawn.scene();
  else if (drawn.kind() == Kind::Mesh)  // the scene shares the mesh with the value
    viewed.scene.meshes.push_back(
        {std::shared_ptr<const TriMesh>(std::shared_ptr<const void>(), &drawn.mesh())});
  else if (drawn.kind() == Kind::Adaptive)
    viewed.scene.meshes.push_back({smoothMesh(levelset::adaptiveToMesh(drawn.adaptive()))});
  else if (drawn.kind() == Kind::Terrain)
    viewed.scene.terrains.push_back({.caster = render::TerrainCaster(drawn.sharedTerrain())});
  else if (drawn.kind() == Kind::Segmentation)
    viewed.scene.meshes = partsOf(drawn.segmentation());
  else
    viewed.scene.solids.push_back({.band = drawn.band()});
  return viewed;
}

}  // namespace pipeline
