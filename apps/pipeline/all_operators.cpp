#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/flow/morph_action.h"
#include "apps/pipeline/operators/level_set_operator.h"
#include "apps/pipeline/operators/pictures/effect_operator.h"
#include "apps/pipeline/operators/solids/adaptive_actions.h"
#include "apps/pipeline/operators/solids/deform_action.h"
#include "apps/pipeline/operators/solids/mesh_action.h"
#include "apps/pipeline/operators/solids/segment_actions.h"
#include "apps/pipeline/operators/solids/segment_edit_actions.h"
#include "apps/pipeline/registry/operator.h"
#include "levelset/advection/advect.h"
#include "levelset/components/components.h"
#include "levelset/convert/closest_triangles.h"
#include "levelset/csg/blend.h"
#include "levelset/csg/smooth_csg.h"
#include "levelset/curvature_flow/curvature_flow.h"
#include "levelset/curvature_flow/smooth.h"
#include "levelset/distance/closest_points.h"
#include "levelset/distance/redistance.h"
#include "levelset/eikonal/arrival.h"
#include "levelset/emboss/emboss.h"
#include "levelset/evolve/evolve.h"
#include "levelset/hamilton_jacobi/pde_redistance.h"
#include "levelset/offset/morphology.h"
#include "levelset/shapes/shapes.h"
#include "levelset/shapes/superquadric.h"

namespace pipeline {

std::vector<Operator> allOperators() {
  return {
      readOperator(),
      writeOperator(),
      levelSetOperator<levelset::SphereOperator>(),
      levelSetOperator<levelset::BoxOperator>(),
      levelSetOperator<levelset::TorusOperator>(),
      levelSetOperator<levelset::CylinderOperator>(),
      levelSetOperator<levelset::CapsuleOperator>(),
      levelSetOperator<levelset::SuperquadricOperator>(),
      levelSetOperator<levelset::SupershapeOperator>(),
      conversionOperator(),
      toBandOperator(),
      surfaceBandOperator(),
      levelSetOperator<levelset::ClosestTriangleOperator>(),
      meshOperator(),
      volumeOperator(),
      blurOperator(),
      histogramOperator(),
      isosurfaceOperator(),
      isosurfaceMeshOperator(),
      thresholdOperator(),
      sampleOperator(),
      normalsOperator(),
      outliersOperator(),
      meshPointsOperator(),
      moleculeSurfaceOperator(),
      moleculeModelOperator(),
      thinOperator(),
      terrainOperator(),
      slopeOperator(),
      sculptOperator(),
      hillshadeOperator(),
      contoursOperator(),
      tileTerrainOperator(),
      terrainMeshOperator(),
      tiledTerrainMeshOperator(),
      solidifyOperator(),
      unionWithSegmentations(unionOperator()),
      intersectionOperator(),
      differenceWithSegmentations(differenceOperator()),
      segmentOperator(),
      extractOperator(),
      relabelOperator(),
      levelSetOperator<levelset::BlendOperator>(),
      levelSetOperator<levelset::SmoothUnionOperator>(),
      levelSetOperator<levelset::SmoothIntersectionOperator>(),
      levelSetOperator<levelset::SmoothDifferenceOperator>(),
      offsetWithSegmentations(offsetOperator()),
      levelSetOperator<levelset::OpenOperator>(),
      levelSetOperator<levelset::CloseOperator>(),
      levelSetOperator<levelset::ShellOperator>(),
      levelSetOperator<levelset::EmbossOperator>(),
      levelSetOperator<levelset::KeepOperator>(),
      levelSetOperator<levelset::FillCavitiesOperator>(),
      levelSetOperator<levelset::AdvectOperator>(),
      levelSetOperator<levelset::EvolveOperator>(),
      levelSetOperator<levelset::ReinitializeOperator>(),
      levelSetOperator<levelset::RebuildBandOperator>(),
      levelSetOperator<levelset::FastMarchingOperator>(),
      levelSetOperator<levelset::FastSweepingOperator>(),
      levelSetOperator<levelset::ClosestPointOperator>(),
      flowWithSegmentations(levelSetOperator<levelset::CurvatureFlowOperator>()),
      levelSetOperator<levelset::SmoothOperator>(),
      morphWithSegmentations(morphOperator()),
      transformWithSegmentations(transformOperator()),
      deformOperator(),
      latticeOperator(),
      cageOperator(),
      resampleOperator(),
      clipOperator(),
      patchOperator(),
      decalOperator(),
      patchGridOperator(),
      scatterOperator(),
      textureOperator(),
      animateOperator(),
      knurlOperator(),
      scalesOperator(),
      hexagonsOperator(),
      ringOperator(),
      gyroidOperator(),
      heightmapOperator(),
      foldsOperator(),
      measureOperator(),
      compareOperator(),
      checkOperator(),
      infoOperator(),
      sceneOperator(),
      sliceOperator(),
      renderOperator(),
      compareImagesOperator(),
      effectOperator(),
      regressOperator(),
      cacheOperator(),
  };
}

}  // namespace pipeline
