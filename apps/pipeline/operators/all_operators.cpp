#include "apps/pipeline/operators/flow/morph_operator.h"
#include "apps/pipeline/operators/level_set_operator.h"
#include "apps/pipeline/operators/solids/mesh_operator.h"
#include "apps/pipeline/registry/operator.h"
#include "levelset/convert/mesh_to_band.h"
#include "levelset/convert/surface_band.h"
#include "levelset/csg/blend.h"
#include "levelset/csg/clip.h"
#include "levelset/csg/csg.h"
#include "levelset/curvature/curvature_flow.h"
#include "levelset/curvature/smooth.h"
#include "levelset/distance/closest_points.h"
#include "levelset/distance/redistance.h"
#include "levelset/eikonal/arrival.h"
#include "levelset/flow/advect.h"
#include "levelset/placement/resample.h"
#include "levelset/placement/transform.h"
#include "levelset/solids/components.h"
#include "levelset/solids/morphology.h"
#include "levelset/solids/offset.h"
#include "levelset/solids/shapes.h"

namespace pipeline {

void addFileOperators(std::vector<Operator>& all);
void addPatchOperators(std::vector<Operator>& all);
void addScatterOperators(std::vector<Operator>& all);
void addTextureOperators(std::vector<Operator>& all);
void addAnimationOperators(std::vector<Operator>& all);
void addGeneratorOperators(std::vector<Operator>& all);
void addFoldOperators(std::vector<Operator>& all);
void addInspectionOperators(std::vector<Operator>& all);
void addSceneOperators(std::vector<Operator>& all);
void addSliceOperators(std::vector<Operator>& all);
void addPictureOperators(std::vector<Operator>& all);
void addRegressionOperators(std::vector<Operator>& all);
void addCacheOperators(std::vector<Operator>& all);

std::vector<Operator> allOperators() {
  std::vector<Operator> all;
  addFileOperators(all);
  all.push_back(levelSetOperator<levelset::SphereOperator>());
  all.push_back(levelSetOperator<levelset::BoxOperator>());
  all.push_back(levelSetOperator<levelset::TorusOperator>());
  all.push_back(levelSetOperator<levelset::CylinderOperator>());
  all.push_back(levelSetOperator<levelset::CapsuleOperator>());
  all.push_back(levelSetOperator<levelset::LevelSetOperator>());
  all.push_back(levelSetOperator<levelset::SurfaceBandOperator>());
  all.push_back(meshOperator());
  all.push_back(levelSetOperator<levelset::UnionOperator>());
  all.push_back(levelSetOperator<levelset::IntersectionOperator>());
  all.push_back(levelSetOperator<levelset::DifferenceOperator>());
  all.push_back(levelSetOperator<levelset::BlendOperator>());
  all.push_back(levelSetOperator<levelset::OffsetOperator>());
  all.push_back(levelSetOperator<levelset::OpenOperator>());
  all.push_back(levelSetOperator<levelset::CloseOperator>());
  all.push_back(levelSetOperator<levelset::ShellOperator>());
  all.push_back(levelSetOperator<levelset::KeepOperator>());
  all.push_back(levelSetOperator<levelset::FillCavitiesOperator>());
  all.push_back(levelSetOperator<levelset::AdvectOperator>());
  all.push_back(levelSetOperator<levelset::ReinitializeOperator>());
  all.push_back(levelSetOperator<levelset::RebuildBandOperator>());
  all.push_back(levelSetOperator<levelset::FastMarchingOperator>());
  all.push_back(levelSetOperator<levelset::FastSweepingOperator>());
  all.push_back(levelSetOperator<levelset::ClosestPointOperator>());
  all.push_back(levelSetOperator<levelset::CurvatureFlowOperator>());
  all.push_back(levelSetOperator<levelset::SmoothOperator>());
  all.push_back(morphOperator());
  all.push_back(levelSetOperator<levelset::TransformOperator>());
  all.push_back(levelSetOperator<levelset::ResampleOperator>());
  all.push_back(levelSetOperator<levelset::ClipOperator>());
  addPatchOperators(all);
  addScatterOperators(all);
  addTextureOperators(all);
  addAnimationOperators(all);
  addGeneratorOperators(all);
  addFoldOperators(all);
  addInspectionOperators(all);
  addSceneOperators(all);
  addSliceOperators(all);
  addPictureOperators(all);
  addRegressionOperators(all);
  addCacheOperators(all);
  return all;
}

}  // namespace pipeline
