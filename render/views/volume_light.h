#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "levelset/memory_limit.h"
#include "levelset/progress.h"
#include "render/direct/direct_volume.h"
#include "render/images/image.h"
#include "render/scene/scene.h"

namespace render {

struct VolumeLightOptions {
  int samples = 4;                       ///< rays for each pixel, at least 1
  bool isShaded = true;                  ///< colours depend on the gradient and the key light
  bool isJudged = false;                 ///< integrate by the code of the judge, which is slower
  std::function<bool()> isStopped = {};  ///< returns true to stop; the light is then unfinished
  std::size_t maxBytes = levelset::kNoMemoryLimit;  ///< limit of the light's memory, bytes
  levelset::Progress progress = {};
};

/// Integrates the light of a volume for each pixel of a picture. A ray ends at the surface that the
/// middle of its pixel shows, in the layer Z. The bits do not depend on the number of threads.
/// @param image  picture of the scene from its camera
/// @return one entry for each pixel
/// @throws levelset::UsageError for transparent solids or meshes, whose order along a ray is not
///         in the picture
/// @throws levelset::ResourceLimit for more memory than options.maxBytes
/// @throws levelset::Cancelled
[[nodiscard]] std::vector<VolumeLight> volumeLight(const Image& image, const Scene& scene,
                                                   const DirectVolume& volume,
                                                   const VolumeLightOptions& options = {});

/// Puts light in front of the colours R G B A of a picture. @pre one entry for each pixel
void addVolumeLight(Image& image, const std::vector<VolumeLight>& light);

}  // namespace render
