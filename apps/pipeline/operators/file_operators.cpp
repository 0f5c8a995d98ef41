#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/tiled_terrain.h"
#include "apps/pipeline/operators/volume_params.h"
#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/values/terrain_picture.h"
#include "levelset/deform/lattice_file.h"
#include "levelset/error.h"
#include "levelset/file_target.h"
#include "levelset/files/band_file.h"
#include "levelset/mesh_files/mesh_file.h"
#include "levelset/molecules/molecule_file.h"
#include "levelset/point_files/point_file.h"
#include "levelset/segmented/files/segmented_file.h"
#include "levelset/segmented/files/segmented_mesh_file.h"
#include "levelset/terrain/files/height_field_file.h"
#include "levelset/terrain/tiles/tiled_ground.h"
#include "levelset/volume_files/volume_file.h"
#include "mapping/patches/patch_file.h"

namespace pipeline {
namespace {

using levelset::UsageError;

/// Returns true for the name of a lattice file, and for a .json file that holds a lattice.
bool isLattice(const Invocation& in, const std::string& name) {
  if (!render::isSceneFormat(name)) return false;
  return name.ends_with(".lattice.json") ||
         (in.op().name == "read" && levelset::isLatticeFile(in.text("file")));
}

bool isStandardStream(const Invocation& in) {
  return in.text("file") == "-";
}

/// Decides if `read` makes points of a file that may hold a mesh: with --points, and if it has no
/// faces.
bool readsPoints(const Invocation& in) {
  return in.flag("points") || levelset::lacksFaces(in.text("file"), in.text("format"));
}

/// Kind of the value of a .vdb or .nvdb file. The headers of its grids decide. --grid names a level
/// set or field.
Kind gridFileKind(const Invocation& in, const std::string& name) {
  if (in.op().name != "read") return Kind::Band;
  if (levelset::holdsPoints(name) &&
      (in.flag("points") ||
       levelset::holdsPointGrid(in.text("file"), in.text("grid"), in.text("format"))))
    return Kind::Points;
  const bool mayBeSegmented = levelset::isVdbFormat(name) && !in.given("grid");
  return mayBeSegmented && levelset::holdsSegmented(in.text("file")) ? Kind::Segmentation
                                                                     : Kind::Band;
}

Kind fileKind(const Invocation& in) {
  const std::string name = formatName(in);
  const bool isRead = in.op().name == "read";
  if (levelset::isPointFormat(name)) return Kind::Points;
  if (levelset::isMeshFormat(name)) return isRead && readsPoints(in) ? Kind::Points : Kind::Mesh;
  if (levelset::isBandFormat(name)) return gridFileKind(in, name);
  if (mapping::isPatchFormat(name)) return Kind::Patch;
  if (isLattice(in, name)) return Kind::Deformation;
  if (render::isSceneFormat(name)) return Kind::Scene;
  if (isRead && levelset::isVolumeFormat(name)) return Kind::Volume;
  if (isRead && levelset::holdsMolecule(name)) return Kind::Molecule;
  if (levelset::isAsciiGridFormat(name) || levelset::isTiledGroundFormat(name))
    return Kind::Terrain;
  if (isRead && (levelset::isHeightFormat(name) || isTerrainPicture(name))) return Kind::Terrain;
  throw UsageError(
      fmt::format("{}: '{}' is of no known format; use ply, obj, stl, off, xyz, csv or pts (also "
                  ".gz), vdb{}, asc, lst, patch or "
                  "json",
                  in.op().name, name,
                  isRead ? ", nii, mha, nrrd, mrc, raw, pdb, cif, hgt, flt, bil, png" : ", nvdb"));
}

/// Returns the kind of the value that `read` makes. The grid that --grid names may be a field; the
/// header of the file shows its class, if the file exists already.
Kind readKind(const Invocation& in) {
  const Kind kind = fileKind(in);
  if (kind != Kind::Band || !in.given("grid") || isStandardStream(in)) return kind;
  try {
    for (const levelset::GridInfo& grid : levelset::bandFileInfo(in.text("file")))
      if (grid.name == in.text("grid")) return grid.isLevelSet ? Kind::Band : Kind::Field;
  } catch (const levelset::Error&) {  // the run itself reports this error
  }
  return kind;
}

/// Reads points. Of a mesh format without a reader of points, reads the mesh and keeps its
/// vertices.
Value readCloud(Invocation& in) {
  const std::filesystem::path file = in.text("file");
  if (levelset::holdsPoints(formatName(in)))
    return Value(levelset::readPoints(file, {.format = in.text("format"),
                                             .grid = in.text("grid"),
                                             .attributes = !in.flag("no-attributes"),
                                             .maxMemory = in.maxMemory,
                                             .notes = &in.notes.notes,
                                             .progress = in.progress}));
  levelset::TriMesh mesh = levelset::readMesh(
      file, {.format = in.text("format"), .maxMemory = in.maxMemory, .progress = in.progress});
  levelset::PointCloud cloud;
  cloud.positions = std::move(mesh.positions);
  cloud.precision = mesh.precision;
  return Value(std::move(cloud));
}

Value read(Invocation& in) {
  const std::filesystem::path file = in.text("file");
  const Kind kind = fileKind(in);
  if (kind == Kind::Points) return readCloud(in);
  if (kind == Kind::Patch)
    return Value(PatchValue{.patches = mapping::readPatches(file, in.maxMemory)});
  if (kind == Kind::Deformation)
    return Value(DeformationValue{
        std::make_shared<levelset::LatticeDeformation>(levelset::readLattice(file, in.maxMemory))});
  if (kind == Kind::Volume) {
    levelset::ReadVolumeOptions options = volumeOptions(in);
    options.notes = &in.notes.notes;
    return Value(levelset::readVolume(file, options));
  }
  if (kind == Kind::Segmentation)
    return Value(
        levelset::readSegmented(file, {.maxMemory = in.maxMemory, .progress = in.progress}));
  if (kind == Kind::Molecule)
    return Value(
        levelset::readMolecule(file, {.format = in.text("format"),
                                      .model = in.given("model") ? in.integerAs<int>("model") : 0,
                                      .solvent = in.flag("solvent"),
                                      .hydrogens = !in.flag("no-hydrogens"),
                                      .maxMemory = in.maxMemory,
                                      .notes = &in.notes.notes,
                                      .progress = in.progress}));
  if (levelset::isTiledGroundFormat(formatName(in))) return readTiledTerrain(in);
  if (kind == Kind::Terrain)
    return Value(isTerrainPicture(formatName(in))
                     ? readTerrainPicture(file, in.maxMemory)
                     : levelset::readHeightField(file, {.format = in.text("format"),
                                                        .maxMemory = in.maxMemory,
                                                        .notes = &in.notes.notes,
                                                        .progress = in.progress}));
  if (kind == Kind::Scene) {
    const auto warn = [&](const levelset::BandRepairs& repairs, const auto& source) {
      for (const std::string& told : sentencesOf(repairs, source))
        in.notes.warnings.push_back(told);
    };
    return Value(render::readScene(
        file, {.maxMemory = in.maxMemory, .repairs = warn, .progress = in.progress}));
  }
  if (kind == Kind::Mesh) {
    std::vector<std::string> unsupported;
    levelset::TriMesh mesh = levelset::readMesh(file, {.format = in.text("format"),
                                                       .attributes = !in.flag("no-attributes"),
                                                       .maxMemory = in.maxMemory,
                                                       .unsupported = &unsupported,
                                                       .progress = in.progress});
    if (!unsupported.empty()) {
      in.notes.warnings.push_back(
          fmt::format("{}: ignored attributes that belong to no vertex of the mesh: {}",
                      file.string(), fmt::join(unsupported, "; ")));
    }
    return Value(std::move(mesh));
  }
  levelset::BandRepairs repairs;
  const levelset::ReadBandOptions options{.grid = in.text("grid"),
                                          .maxMemory = in.maxMemory,
                                          .region = in.roi.region,
                                          .repairs = &repairs,
                                          .progress = in.progress};
  Value value = in.given("grid") ? std::visit([](auto grid) { return Value(std::move(grid)); },
                                              levelset::readGrid(file, options))
                                 : Value(levelset::readBand(file, options));
  const std::vector<std::string> told = sentencesOf(repairs, file);
  in.notes.warnings.insert(in.notes.warnings.end(), told.begin(), told.end());
  return value;
}

/// Plans the value. A mesh is read completely, since lengths in % refer to its size. For a band,
/// the header of the file suffices.
Plan planRead(Invocation& in) {
  const Kind kind = fileKind(in);
  if (kind == Kind::Volume) {
    const levelset::VolumeFileInfo info =
        levelset::volumeFileInfo(in.text("file"), volumeOptions(in));
    return planOf(info.grid, info.type);
  }
  if (kind == Kind::Segmentation) {
    const levelset::SegmentedFileInfo info = levelset::segmentedFileInfo(in.text("file"));
    Plan plan{.kind = Kind::Band,  // as large as a band of this half width
              .bounds = info.worldBounds,
              .voxelSize = info.voxelSize,
              .halfWidth = info.halfWidth};
    plan.area = static_cast<double>(info.activeVoxels) * info.voxelSize * info.voxelSize /
                (2 * info.halfWidth);
    plan.fieldBytes = plan.bytes();
    plan.kind = Kind::Segmentation;
    return plan;
  }
  if (levelset::isTiledGroundFormat(formatName(in))) return planTiledTerrain(in);
  if (kind != Kind::Band) return read(in).plan();
  for (const levelset::GridInfo& grid : levelset::bandFileInfo(in.text("file"))) {
    if (in.given("grid") ? grid.name != in.text("grid") : !grid.isLevelSet) continue;
    if (!grid.isLevelSet) {
      Plan plan{.kind = Kind::Field, .voxelSize = grid.voxelSize};
      plan.fieldBytes = static_cast<double>(grid.bytes);
      return plan;
    }
    Plan plan{.kind = Kind::Band, .voxelSize = grid.voxelSize, .halfWidth = grid.halfWidth};
    if (!grid.worldBounds.isEmpty()) {
      // The zero set lies one half width inside the box of the active voxels.
      plan.bounds = grid.worldBounds;
      const Imath::V3d rim(plan.halfWidth * plan.voxelSize);
      if (Imath::Box3d inner(plan.bounds.min + rim, plan.bounds.max - rim); !inner.isEmpty())
        plan.bounds = inner;
    }
    plan.area = static_cast<double>(grid.activeVoxels) * grid.voxelSize * grid.voxelSize /
                (2 * plan.halfWidth);
    return plan;
  }
  return read(in).plan();
}

void validateRead(const Invocation& in) {
  const Kind kind = fileKind(in);
  checkVolumeOptions(in, kind == Kind::Volume);
  checkTiledOptions(in, tiledReadParams(), levelset::isTiledGroundFormat(formatName(in)));
  if (kind != Kind::Mesh && kind != Kind::Points && in.flag("no-attributes"))
    throw UsageError(
        fmt::format("read: --no-attributes is for meshes and point clouds, and this is a {}; leave "
                    "it out",
                    kindName(kind)));
  if (kind != Kind::Points && in.flag("points"))
    throw UsageError(
        fmt::format("read: --points is for meshes and .vdb files, and this is a {}; leave it out",
                    kindName(kind)));
  for (const char* name : {"model", "solvent", "no-hydrogens"})
    if (kind != Kind::Molecule && in.given(name))
      throw UsageError(fmt::format("read: --{} is for molecules, and this is a {}; leave it out",
                                   name, kindName(kind)));
  if (!levelset::isBandFormat(formatName(in)) && in.given("grid"))
    throw UsageError(fmt::format(
        "read: --grid picks a grid of a .vdb, and this is a {}; leave it out", kindName(kind)));
  if (kind == Kind::Terrain && isStandardStream(in) && !levelset::isAsciiGridFormat(formatName(in)))
    throw UsageError(
        "read: only terrain of the format asc can be read from standard input; give a file, not -");
  if (kind == Kind::Scene && isStandardStream(in))
    throw UsageError(
        "read: a scene refers to other files relative to the folder of its own file, so it cannot "
        "be read from standard input; give a file, not -");
}

void validateWrite(const Invocation& in) {
  const Kind kind = fileKind(in), held = in.operands[0].kind();
  const bool isLabelled =
      held == Kind::Segmentation &&
      (levelset::holdsAttributes(formatName(in)) || levelset::isVdbFormat(formatName(in)));
  const bool isCloud = held == Kind::Points && levelset::holdsPoints(formatName(in));
  const bool isLatticeFile = held == Kind::Deformation && kind == Kind::Scene;
  if (held != kind && !isCloud && !isLabelled && !isLatticeFile &&
      !(held == Kind::Field && kind == Kind::Band)) {
    throw UsageError(fmt::format(
        "write: {} cannot be written as '{}'; {}", kindPhrase(held), formatName(in),
        held == Kind::Band           ? "put 'mesh' before it, or write .vdb"
        : held == Kind::Field        ? "write .vdb"
        : held == Kind::Patch        ? "write .patch, or put 'mesh' before it"
        : held == Kind::Scene        ? "write .json"
        : held == Kind::Volume       ? "put 'isosurface' before it"
        : held == Kind::Adaptive     ? "put 'mesh' or 'to-band' before it"
        : held == Kind::Segmentation ? "write .vdb, .ply or .obj, or put 'extract LABEL' before it"
        : held == Kind::Molecule     ? "put 'molecule-surface' before it"
        : held == Kind::Terrain      ? "write .asc or .lst, or put 'mesh' before it"
        : held == Kind::Deformation  ? "write .json"
        : held == Kind::Points       ? "write .ply, .obj, .xyz, .csv, .pts or .vdb"
        : kind == Kind::Points       ? "put 'sample' before it, or write .ply"
                                     : "put 'level-set' before it, or write .ply"));
  }
  checkTiledOptions(in, tiledWriteParams(), levelset::isTiledGroundFormat(formatName(in)));
  if (held == Kind::Segmentation && in.given("name"))
    throw UsageError(
        "write: --name is the name of the grid of a level set, but the grids of a segmentation "
        "have names of their own; leave it out");
  if (!levelset::isBandFormat(formatName(in)) && in.given("name"))
    throw UsageError(fmt::format(
        "write: --name is the name of a grid in a .vdb, and this file is a {}; leave it out",
        kindName(isCloud ? held : kind)));
  if (held == Kind::Scene && levelset::isStandardOutput(in.text("file")))
    throw UsageError(
        "write: a scene stores its level sets in files beside its own file, so it cannot go to "
        "standard output; give a file");
}

Value write(Invocation& in) {
  const std::filesystem::path file = in.text("file");
  const Value& value = in.operands[0];
  if (value.kind() == Kind::Patch) {
    if (value.patch().atHeight)
      throw UsageError(
          "write: this patch has --height auto, and its height is unknown without a texture; give "
          "--height a length");
    mapping::writePatches(file, value.patch().patches);
  } else if (value.kind() == Kind::Deformation) {
    const levelset::ControlLattice* lattice = value.deformation().lattice();
    if (!lattice)
      throw UsageError(
          "write: a cage has no file of its own; write its two meshes before 'cage' joins them");
    levelset::writeLattice(file, *lattice);
  } else if (value.kind() == Kind::Scene) {
    render::writeScene(file, value.scene(), in.progress);
  } else if (levelset::isTiledGroundFormat(formatName(in))) {
    levelset::writeTiledGround(file, value.terrain(), tiledWriteOptions(in));
  } else if (value.kind() == Kind::Terrain) {
    levelset::writeHeightField(file, value.terrain(), {.progress = in.progress});
    if (value.terrain().isGeographic)
      in.notes.warnings.push_back(fmt::format(
          "x and y are degrees, but {} does not store this, and is read as lengths; put a file {} "
          "beside it that holds GEOGCS[\"WGS 84\"]",
          file.string(), std::filesystem::path(file).replace_extension(".prj").string()));
    else if (!value.terrain().coordinateSystem.empty())
      in.notes.warnings.push_back(
          fmt::format("{} does not store the coordinate system '{}'; copy its .prj file beside it",
                      file.string(), value.terrain().coordinateSystem));
  } else if (value.kind() == Kind::Field) {
    levelset::writeField(file, value.field(),
                         {.name = in.given("name") ? in.text("name") : value.field().name(),
                          .format = in.text("format"),
                          .progress = in.progress});
  } else if (value.kind() == Kind::Segmentation && levelset::isVdbFormat(formatName(in))) {
    levelset::writeSegmented(file, value.segmentation(), {.progress = in.progress});
  } else if (value.kind() == Kind::Segmentation) {
    levelset::writeSegmentedMesh(
        file,
        levelset::segmentedToMesh(
            value.segmentation(),
            {.maxMemory = in.maxMemory, .progress = levelset::subProgress(in.progress, 0, 0.8)}),
        {.format = in.text("format"), .progress = levelset::subProgress(in.progress, 0.8, 1)});
  } else if (value.kind() == Kind::Points) {
    levelset::writePoints(file, value.cloud(),
                          {.format = in.text("format"),
                           .name = in.given("name") ? in.text("name") : "points",
                           .progress = in.progress});
    if (const std::string lost = unwritableAttributes(formatName(in), value.cloud()); !lost.empty())
      in.notes.warnings.push_back(
          fmt::format("{} cannot store the {}, which were left out; write .ply to keep them",
                      file.string(), lost));
  } else if (value.kind() == Kind::Mesh) {
    levelset::writeMesh(
        file, value.mesh(),
        {.format = in.text("format"), .maxMemory = in.maxMemory, .progress = in.progress});
    if (!value.mesh().attributes.isEmpty() && !levelset::holdsAttributes(formatName(in)))
      in.notes.warnings.push_back(
          fmt::format("{} stores positions and triangles only: the {} were left out; write .ply or "
                      ".obj to keep them",
                      file.string(), describe(value.mesh().attributes)));
  } else {
    levelset::writeBand(
        file, value.band(),
        {.name = in.text("name"), .format = in.text("format"), .progress = in.progress});
  }
  return value;
}

}  // namespace

Operator readOperator() {
  Operator op{
      .name = "read",
      .group = "Files",
      .summary =
          "read a mesh, level set, field, segmentation, volume, point cloud, patches, scene, "
          "molecule, terrain or lattice",
      .details =
          "Meshes are ply, obj, stl or off, also with .gz. Level sets, fields and segmentations "
          "are "
          "vdb. Volumes are nii, hdr, mha, mhd, nrrd, nhdr, mrc, map or raw. Points are xyz, csv "
          "or "
          "pts, ply or obj without faces, or a vdb with a grid of points. Patches are patch, and "
          "scenes json. Molecules are pdb or cif, and terrains asc, hgt, flt, bil, lst or png. "
          "A .vdb with more than one level set needs --grid. A grid that is not a level set needs "
          "--grid, too; it becomes a field of numbers or of vectors, which may be staggered. "
          "Meshes keep the normals, texture coordinates and colours of their vertices in PLY and "
          "OBJ. Point clouds keep normals, colours, radii and weights. In xyz and csv, a header "
          "line "
          "names the columns (x, y, z, nx, ny, nz, r, g, b, a, radius, weight); without it, their "
          "number decides. In a .vdb, the attributes P, N, Cd, Alpha, pscale and weight of a grid "
          "of "
          "points are read. Volumes keep their spacing and orientation; a .raw needs --size and "
          "--type. "
          "The json file of a Bézier volume is a scene, too. A json file of a lattice is a "
          "deformation. "
          "A terrain has heights of a ground; those of a grey png are from 0 (black) to 1 (white). "
          "Transparent pixels are missing. Of a tiled terrain (lst), --box and --level read a "
          "part. "
          "Of a molecule, the first model is read, without water. Of alternate locations of an "
          "atom "
          "the one with the largest occupancy counts. "
          "'-' is standard input and needs --format.",
      .example = "levelsmith read dragon.ply.gz ! info",
      .params = {{.name = "file",
                  .type = ParamType::Path,
                  .doc = "file to read, or - for standard input",
                  .required = true,
                  .position = 0},
                 {.name = "format",
                  .type = ParamType::Text,
                  .doc = "format of the file: ply, obj, stl, off, xyz, csv, pts, vdb, nii, mha, "
                         "nrrd, mrc, raw, patch, json, pdb, cif, asc, hgt, flt, bil, lst or png; "
                         "default: by its extension"},
                 {.name = "grid",
                  .type = ParamType::Text,
                  .doc = "name of the grid to read from a .vdb"},
                 {.name = "no-attributes",
                  .type = ParamType::Flag,
                  .doc = "for meshes and point clouds: read positions and triangles only, without "
                         "normals, texture coordinates, colours, radii and weights",
                  .formerName = "bare"},
                 {.name = "points",
                  .type = ParamType::Flag,
                  .doc = "read the vertices of a mesh, or the grid of points of a .vdb that also "
                         "has a level set, as a point cloud"},
                 {.name = "model",
                  .type = ParamType::Integer,
                  .doc = "for molecules: number of the model to read; default: the first one",
                  .range = Range::Positive},
                 {.name = "solvent", .type = ParamType::Flag, .doc = "for molecules: keep water"},
                 {.name = "no-hydrogens",
                  .type = ParamType::Flag,
                  .doc = "for molecules: leave hydrogen atoms out"}},
      .resultKind = readKind,
      .run = read,
      .plan = planRead,
      .cost = costPerVoxel(50, 0, 250),
      .makesParts = true,
      .validate = validateRead,
      .usesStandardInput = isStandardStream,
  };
  for (Param& param : volumeFileParams()) op.params.push_back(std::move(param));
  for (Param& param : tiledReadParams()) op.params.push_back(std::move(param));
  return op;
}

Operator writeOperator() {
  Operator op{
      .name = "write",
      .group = "Files",
      .summary =
          "write meshes, level sets, fields, points, patches, scenes, segmentations, terrains and "
          "lattices",
      .details =
          "Meshes go to ply, obj, stl or off, also with .gz. Level sets and fields go to vdb or "
          "nvdb, "
          "and points to ply, obj, xyz, csv or pts, also with .gz, or to vdb. Patches go to patch, "
          "scenes and lattices to json, and terrains to asc or lst. Segmentations go to vdb, or to "
          "ply or obj with the "
          "labels on both sides of each face. "
          "Data is written to a temporary file in the same folder, which replaces an existing file "
          "only when it is complete. The level sets and meshes of a scene go to .vdb and .ply "
          "files in the same folder: the level set NAME of FILE.json goes to FILE-NAME.vdb. "
          "Existing files of these names are replaced. Points in a .vdb have the attributes P, N, "
          "Cd, "
          "Alpha, pscale and weight, and voxels with about eight points. The value stays on the "
          "stack.",
      .example = "levelsmith sphere --radius 1 --voxel 0.05 ! mesh ! write sphere.ply",
      .params =
          {{.name = "file",
            .type = ParamType::Path,
            .doc = "file to write, or - for standard output",
            .required = true,
            .position = 0},
           {.name = "format",
            .type = ParamType::Text,
            .doc =
                "format of the file: ply, obj, stl, off, xyz, csv, pts, vdb, nvdb, asc, lst, patch "
                "or json; default: by its extension"},
           {.name = "name",
            .type = ParamType::Text,
            .doc =
                "name of the grid in a .vdb or .nvdb; a field keeps its own name by default, and "
                "points get the name 'points'",
            .fallback = "surface"}},
      .operands = {{Kind::Mesh, Kind::Band, Kind::Field, Kind::Patch, Kind::Scene, Kind::Points,
                    Kind::Adaptive, Kind::Segmentation, Kind::Molecule, Kind::Terrain,
                    Kind::Deformation}},
      .flow = Flow::PassesThrough,
      .run = write,
      .cost = costPerVoxel(50, 0, 20),
      .validate = validateWrite,
      .targets = [](const Invocation& in) { return std::vector{in.text("file")}; },
      .usesStandardOutput =
          [](const Invocation& in) { return levelset::isStandardOutput(in.text("file")); },
  };
  for (Param& param : tiledWriteParams()) op.params.push_back(std::move(param));
  return op;
}

}  // namespace pipeline
