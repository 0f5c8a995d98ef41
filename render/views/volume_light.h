#pragma once

#include <functional>

#include "levelset/progress.h"
#include "render/images/image.h"
#include "render/scene/scene.h"
#include "render/volumes/direct_volume.h"

namespace render {

struct VolumeLightOptions {
  int samples = 4;                       ///< rays for each pixel, at least 1
  bool isShaded = true;                  ///< colours depend on the gradient and the key light
  bool isJudged = false;                 ///< integrate by the code of the judge, which is slower
  std::function<bool()> isStopped = {};  ///< returns true to stop; the image is then unfinished
  levelset::Progress progress = {};
};

/// Adds the light of a volume to the colours R G B A of a picture. A ray ends at the surface that
/// the middle of its pixel shows, in the layer Z. The bits do not depend on the number of threads.
/// @param image  picture of the scene from its camera
/// @throws levelset::UsageError for transparent solids or meshes, whose order along a ray is not
///         in the picture
/// @throws levelset::Cancelled
void addVolumeLight(Image& image, const Scene& scene, const DirectVolume& volume,
                    const VolumeLightOptions& options = {});

}  // namespace render
