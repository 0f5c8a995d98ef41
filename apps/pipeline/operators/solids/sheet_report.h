#pragma once

#include "apps/pipeline/operators/json_output.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/segmented/meshing/measure_segmented.h"
#include "levelset/segmented/sources/segment_mesh.h"

/// Reports on segmentations with sheets: surfaces with one region on both sides.
namespace pipeline {

/// Puts the sheets, and the surfaces that are closer than a voxel, into the notes, the warnings and
/// the certificate of `segment --sheets`.
void reportSheets(const levelset::SegmentMeshResult& result, Invocation& in);

/// Notes that the solid or surface of one region leaves out the sheets inside it, if it has some.
/// @param action  with its article, for example "a level set"
void noteLostSheets(const levelset::SegmentedField& field, levelset::RegionLabel label,
                    const char* action, StepNotes& notes);

/// Adds the areas of sheets and the length of their rims to the figures of a segmentation. Without
/// sheets it adds nothing.
void addSheetFigures(const levelset::SegmentedField& field,
                     const levelset::SegmentedMeasurement& measured, Json& json);

}  // namespace pipeline
