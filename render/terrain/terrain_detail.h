#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "levelset/mesh.h"
#include "levelset/terrain/tiles/patch_store.h"
#include "render/camera.h"

/// Terrains of any size at the level of detail that a picture needs.
namespace render {

struct PatchHeights;

/// Patches of a terrain for one picture. They cover the visible ground once. Common borders of
/// patches have the same vertices and edges, so there are no cracks.
struct TerrainSelection {
  struct Part {
    int level = 0, column = 0, row = 0;  ///< place of the patch in the pyramid
    unsigned coarserSides = 0;           ///< sides with a coarser neighbour, set of PatchSide
    std::shared_ptr<const PatchHeights> heights;
  };
  std::vector<Part> parts;  ///< coarser levels first
  /// All patches that the pixel error needs are drawn. Otherwise some are late, have failed or do
  /// not fit into the memory, and a coarser patch is drawn for each of them. A coarse patch has
  /// holes around the vertices of missing samples, which are larger than those of the data.
  bool isComplete = true;
};

struct TerrainDetailOptions {
  /// Limit on the memory of the heights of patches, bytes.
  std::size_t maxBytes = std::size_t{256} << 20;
  /// Called from another thread when a patch arrived or failed.
  std::function<void()> onArrival = {};
};

/// Chooses the patches of a terrain for a camera, and keeps their heights in memory.
///
/// The distance in the picture between a ground point and the point drawn above or below it is at
/// most the pixel error, for every ground point in the picture. All drawn vertices are samples.
/// Where a patch has a coarser neighbour, it leaves out every second vertex of the common border;
/// the difference of the two triangulations counts as part of its error. Vertices and triangles
/// with missing samples do not exist.
class TerrainDetail {
 public:
  /// @param store  not null
  /// @throws InvalidInput for a terrain in degrees
  /// @throws UsageError for a limit of memory below that of 16 patches
  /// @throws the error of the store when the coarsest patch cannot be read
  explicit TerrainDetail(std::shared_ptr<const levelset::PatchStore> store,
                         TerrainDetailOptions options = {});
  ~TerrainDetail();
  TerrainDetail(const TerrainDetail&) = delete;
  TerrainDetail& operator=(const TerrainDetail&) = delete;

  enum class Reading {
    Now,  ///< reads all patches first; the result depends on the arguments and the store alone
    Background  ///< uses the patches that are there, and asks a thread for the others
  };
  /// Chooses the patches of a picture.
  /// @param pixelError  pixels, positive
  /// @throws UsageError for a pixel error that is not positive and finite, and as validate()
  [[nodiscard]] TerrainSelection select(const Camera& camera, double pixelError,
                                        Reading reading = Reading::Now);

  [[nodiscard]] const levelset::GroundLayout& layout() const;
  /// Returns and removes the sentences about patches that could not be read.
  [[nodiscard]] std::vector<std::string> takeWarnings();
  /// Returns true when the thread has nothing to read.
  [[nodiscard]] bool isIdle() const;
  /// Memory that the heights take now, and the most they took so far, bytes. Selections that the
  /// caller holds may keep further heights alive.
  [[nodiscard]] std::size_t memoryUse() const;
  [[nodiscard]] std::size_t mostMemoryUse() const;

 private:
  struct Patches;
  std::unique_ptr<Patches> patches_;
};

/// Makes a mesh of the triangles of a selection. They face upwards. Vertices are samples, in world
/// units, and common to all triangles around them.
[[nodiscard]] levelset::TriMesh terrainTriangles(const levelset::GroundLayout& layout,
                                                 const TerrainSelection& selection);

}  // namespace render
