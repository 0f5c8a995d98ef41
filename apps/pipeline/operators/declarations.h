#pragma once

#include "apps/pipeline/registry/operator.h"

/// Operators for files, textures, pictures and inspection, which the pipeline itself describes. The
/// operators on level sets are described in the library levelset, see level_set_operator.h.
namespace pipeline {

[[nodiscard]] Operator readOperator();
[[nodiscard]] Operator writeOperator();

[[nodiscard]] Operator knurlOperator();
[[nodiscard]] Operator scalesOperator();
[[nodiscard]] Operator hexagonsOperator();
[[nodiscard]] Operator ringOperator();
[[nodiscard]] Operator gyroidOperator();
[[nodiscard]] Operator heightmapOperator();

[[nodiscard]] Operator patchOperator();
[[nodiscard]] Operator decalOperator();
[[nodiscard]] Operator patchGridOperator();

[[nodiscard]] Operator scatterOperator();

[[nodiscard]] Operator textureOperator();

[[nodiscard]] Operator animateOperator();

[[nodiscard]] Operator foldsOperator();

[[nodiscard]] Operator measureOperator();
[[nodiscard]] Operator compareOperator();
[[nodiscard]] Operator checkOperator();
[[nodiscard]] Operator infoOperator();

[[nodiscard]] Operator volumeOperator();
[[nodiscard]] Operator blurOperator();
[[nodiscard]] Operator histogramOperator();
[[nodiscard]] Operator isosurfaceMeshOperator();
[[nodiscard]] Operator isosurfaceOperator();
[[nodiscard]] Operator thresholdOperator();
[[nodiscard]] Operator resampleOperator();

[[nodiscard]] Operator sampleOperator();
[[nodiscard]] Operator normalsOperator();
[[nodiscard]] Operator outliersOperator();
[[nodiscard]] Operator meshPointsOperator();
[[nodiscard]] Operator moleculeSurfaceOperator();
[[nodiscard]] Operator moleculeModelOperator();
[[nodiscard]] Operator thinOperator();

[[nodiscard]] Operator terrainOperator();
[[nodiscard]] Operator slopeOperator();
[[nodiscard]] Operator sculptOperator();
[[nodiscard]] Operator hillshadeOperator();
[[nodiscard]] Operator contoursOperator();
[[nodiscard]] Operator tileTerrainOperator();
[[nodiscard]] Operator terrainMeshOperator();
[[nodiscard]] Operator tiledTerrainMeshOperator();
[[nodiscard]] Operator solidifyOperator();
/// The action `surface-band`, for open meshes and terrains.
[[nodiscard]] Operator surfaceBandOperator();

[[nodiscard]] Operator conversionOperator();
[[nodiscard]] Operator transformOperator();
[[nodiscard]] Operator clipOperator();
[[nodiscard]] Operator latticeOperator();
[[nodiscard]] Operator cageOperator();

[[nodiscard]] Operator sceneOperator();

[[nodiscard]] Operator sliceOperator();

[[nodiscard]] Operator renderOperator();
[[nodiscard]] Operator compareImagesOperator();

[[nodiscard]] Operator regressOperator();

[[nodiscard]] Operator cacheOperator();

}  // namespace pipeline
