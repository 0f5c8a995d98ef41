#pragma once

#include <Imath/ImathBox.h>

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "levelset/adaptive/adaptive_field.h"
#include "levelset/deform/deformation.h"
#include "levelset/fields/grid.h"
#include "levelset/mesh.h"
#include "levelset/molecules/molecule.h"
#include "levelset/narrow_band.h"
#include "levelset/operator/plan.h"
#include "levelset/points/point_cloud.h"
#include "levelset/segmented/segmented_field.h"
#include "levelset/terrain/height_field.h"
#include "levelset/volumes/volume.h"
#include "mapping/animation/animation.h"
#include "mapping/patches/patch.h"
#include "render/views/scene_file.h"

namespace pipeline {

enum class Kind {
  Mesh,
  Band,
  Patch,
  Field,
  Surface,  ///< a band around an open surface: a base for patches
  Scene,
  Volume,        ///< numbers on a regular grid, from a scanner or a simulation
  Points,        ///< points without connectivity, from a scanner or a simulation
  Adaptive,      ///< a solid as distances on an octree
  Segmentation,  ///< a partition of space into regions with labels
  Molecule,      ///< atoms in residues and chains
  Terrain,       ///< heights of a ground on a regular grid
  Deformation    ///< a map of space: a lattice of control points, or a cage
};
/// Kinds that a Value may have.
inline constexpr std::size_t kKinds = static_cast<std::size_t>(Kind::Deformation) + 1;
[[nodiscard]] const char* kindName(Kind kind);
/// Returns the name with its article: "a mesh", "an adaptive field".
[[nodiscard]] std::string kindPhrase(Kind kind);

/// Predicted properties of a value, known before it is computed. They suffice to resolve lengths
/// and to estimate cost.
struct Plan {
  Kind kind = Kind::Band;
  Imath::Box3d bounds = {};  ///< bounds of the zero set or of the vertices, world units
  double area = 0;           ///< surface area, world units²
  double voxelSize = 0;      ///< voxel size, world units; 0: the value has no voxels
  double halfWidth = 0;      ///< half width, voxels; bands and scenes only
  /// Memory, bytes; fields, volumes, adaptive fields, segmentations and terrains only.
  double fieldBytes = 0;
  double triangles = 0;   ///< number of triangles; meshes only; 0: unknown
  double points = 0;      ///< number of points of a point cloud, or atoms of a molecule; 0: unknown
  double pointBytes = 0;  ///< memory of a point or an atom, bytes
  /// Patches only: size along u, size along v and height, world units. Height 0: the texture that
  /// is mapped will determine it.
  Imath::V3d patchSize = Imath::V3d(0);
  double patchCount = 1;  ///< patches only: number of patches
  /// Terrains, and volumes of one layer: number of samples along x and y; 0: unknown.
  Imath::V2i samples = Imath::V2i(0);

  /// Returns the plan in the form that the operators of the library levelset read.
  [[nodiscard]] levelset::ValuePlan estimate() const;
  void set(const levelset::ValuePlan& estimate);
  /// Estimated number of active voxels of a band with the area, voxel size and half width of the
  /// plan.
  [[nodiscard]] double activeVoxels() const;
  /// Estimated memory of the value, bytes.
  [[nodiscard]] double bytes() const;
};

/// Plans a volume. Its voxel size is the smallest spacing.
[[nodiscard]] Plan planOf(const levelset::VolumeGrid& grid, levelset::VolumeType type);

/// Memory of a point with its attributes, bytes.
[[nodiscard]] double bytesPerPoint(const levelset::PointCloud& cloud);

/// Description of how patches were built, to rebuild them on another base or at another position.
struct PatchRecipe {
  /// Extracts the outlines that are transferred to another base.
  std::function<std::vector<mapping::PatchOutline>(const std::vector<mapping::Patch>&)> outlines =
      {};
  /// Builds patches from transferred outlines.
  mapping::PatchMaker make = {};
  /// Replaces `outlines` and `make` for patches around a fixed axis.
  std::function<std::vector<mapping::Patch>(const levelset::NarrowBand& base, double height,
                                            const levelset::Progress& progress)>
      around = {};
  bool isRigid = false;     ///< centre and direction determine the patch, as for a decal
  std::string fixed = {};   ///< reason why the patch cannot be moved; empty: it can
  std::string action = {};  ///< action that built the patches
  /// Options without position and height: `shape` determines the geometry, `fineness` only its
  /// resolution.
  std::map<std::string, std::string> shape = {}, fineness = {};
};

/// One or several patches on one base.
struct PatchValue {
  std::vector<mapping::Patch> patches;
  /// Builds the patches for a given height. Set only with `--height auto`, where the texture
  /// determines the height.
  std::function<std::vector<mapping::Patch>(double height, const levelset::Progress&)> atHeight =
      {};
  std::shared_ptr<const PatchRecipe> recipe = {};  ///< null for patches from files
};

/// A map of space that moves solids, meshes, points and patches.
struct DeformationValue {
  std::shared_ptr<const levelset::Deformation> map;  ///< not null
  /// Largest distance of a ready lattice from its closed form, world units; 0 for others.
  double error = 0;

  /// Returns the lattice, or null for a cage.
  [[nodiscard]] const levelset::ControlLattice* lattice() const;
  /// Number of control points of a lattice, or of vertices of a cage.
  [[nodiscard]] std::size_t controlPoints() const;
};

/// A value of a chain: immutable and cheap to copy. In a dry run it contains only a plan.
class Value {
 public:
  explicit Value(levelset::TriMesh mesh);
  explicit Value(levelset::NarrowBand band);
  explicit Value(PatchValue patch);
  explicit Value(levelset::FieldGrid field);
  explicit Value(render::ViewedScene scene);
  explicit Value(levelset::Volume volume);
  explicit Value(levelset::PointCloud cloud);
  explicit Value(levelset::AdaptiveField field);
  explicit Value(levelset::SegmentedField field);
  explicit Value(levelset::Molecule molecule);
  explicit Value(levelset::HeightField terrain);
  explicit Value(DeformationValue deformation);
  explicit Value(Plan plan);

  [[nodiscard]] Kind kind() const;
  // mesh(), band() and so on return the value as that kind. A file may contain another kind than
  // its name suggests.
  // @throws levelset::UsageError if the value is of another kind
  [[nodiscard]] const levelset::TriMesh& mesh() const;
  [[nodiscard]] const levelset::NarrowBand& band() const;
  [[nodiscard]] const PatchValue& patch() const;
  [[nodiscard]] const levelset::FieldGrid& field() const;
  [[nodiscard]] const render::ViewedScene& scene() const;
  [[nodiscard]] const levelset::Volume& volume() const;
  [[nodiscard]] const levelset::PointCloud& cloud() const;
  [[nodiscard]] const levelset::AdaptiveField& adaptive() const;
  [[nodiscard]] const levelset::SegmentedField& segmentation() const;
  [[nodiscard]] const levelset::Molecule& molecule() const;
  [[nodiscard]] const levelset::HeightField& terrain() const;
  [[nodiscard]] const DeformationValue& deformation() const;
  [[nodiscard]] std::shared_ptr<const levelset::HeightField> sharedTerrain() const;
  /// Takes the terrain out of this value. Copies it if other values share it. This value keeps its
  /// plan and an empty terrain. @throws levelset::ResourceLimit for a copy
  [[nodiscard]] levelset::HeightField takeTerrain(std::size_t maxMemory);

  /// Returns the plan of the value: its kind, bounds, area and grid, which estimates need. Computes
  /// it from the value on the first call.
  [[nodiscard]] const Plan& plan() const;
  /// Diagonal of the bounding box, world units; 0 if the box is empty.
  [[nodiscard]] double diagonal() const {
    return plan().bounds.isEmpty() ? 0 : plan().bounds.size().length();
  }

 private:
  template <typename T>
  [[nodiscard]] const T& as(Kind wanted) const;

  std::variant<std::monostate, std::shared_ptr<const levelset::TriMesh>, levelset::NarrowBand,
               std::shared_ptr<const PatchValue>, levelset::FieldGrid,
               std::shared_ptr<const render::ViewedScene>, std::shared_ptr<const levelset::Volume>,
               std::shared_ptr<const levelset::PointCloud>, levelset::AdaptiveField,
               levelset::SegmentedField, std::shared_ptr<const levelset::Molecule>,
               std::shared_ptr<const levelset::HeightField>, DeformationValue>
      data_;
  mutable std::optional<Plan> plan_;
};

/// Builds a scene that shows a level set, a mesh, an adaptive field, a segmentation, a terrain or a
/// scene. The value must outlive the result. Of adaptive fields and segmentations it makes meshes.
[[nodiscard]] render::ViewedScene sceneOf(const Value& drawn);

}  // namespace pipeline
