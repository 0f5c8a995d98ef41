#include "levelset/components/components.h"

namespace levelset {

const OperatorText KeepOperator::text{
    .name = "keep",
    .group = "Solids",
    .summary = "keep the largest solids and drop small parts",
    .example =
        "levelsmith sphere --radius 2 --voxel 0.1 ! sphere --radius 0.5 --center 4,0,0 "
        "--voxel 0.1 ! union ! keep --largest 1 ! measure"};

NarrowBand KeepOperator::run(std::vector<NarrowBand> operands, const Options& options,
                             OperatorRun& run) {
  return keepLargest(operands[0], options.largest, run.progress);
}

std::optional<Cost> KeepOperator::cost(const Options&, const OperatorPlans& plans) {
  return costPerVoxel(plans, 200, 22);
}

const OperatorText FillCavitiesOperator::text{
    .name = "fill-cavities",
    .group = "Solids",
    .summary = "fill enclosed voids",
    .example =
        "levelsmith sphere --radius 2 --voxel 0.1 ! sphere --radius 1 --voxel 0.1 ! "
        "difference ! fill-cavities ! measure"};

NarrowBand FillCavitiesOperator::run(std::vector<NarrowBand> operands, const Options& options,
                                     OperatorRun& run) {
  return fillCavities(operands[0], options.upTo.value_or(kAnyVolume), run.progress);
}

std::optional<Cost> FillCavitiesOperator::cost(const Options&, const OperatorPlans& plans) {
  return costPerVoxel(plans, 200, 22);
}

}  // namespace levelset
