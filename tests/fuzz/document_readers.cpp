#include <filesystem>

#include "apps/pipeline/cache/cache.h"
#include "apps/pipeline/values/digest.h"
#include "apps/pipeline/values/mesh_bytes.h"
#include "levelset/deform/lattice_file.h"
#include "levelset/files/band_file.h"
#include "levelset/mesh_files/mesh_file.h"
#include "levelset/molecules/molecule_file.h"
#include "levelset/shapes/shapes.h"
#include "mapping/patches/patch_file.h"
#include "render/views/bezier_file.h"
#include "render/views/quadric_file.h"
#include "render/views/scene_file.h"
#include "tests/fuzz/readers.h"

namespace fuzz {
namespace {

void readPatch(std::string_view bytes) {
  const std::filesystem::path file = scratchFile("some.patch", bytes);
  accepts([&] {
    for (const mapping::Patch& patch : mapping::readPatches(file, kMaxMemory))
      require(patch.layers.size() >= 2, "a patch has levels");
  });
}

void readLattice(std::string_view bytes) {
  const std::filesystem::path file = scratchFile("lattice.json", bytes);
  accepts([&] {
    const levelset::ControlLattice lattice = levelset::readLattice(file, kMaxMemory);
    require(lattice.data().points.size() >= 8, "a lattice has eight control points");
  });
}

void readBezier(std::string_view bytes) {
  const std::filesystem::path file = scratchFile("bezier.json", bytes);
  accepts([&] {
    const render::BezierVolume volume = render::readBezierVolume(file, kMaxMemory);
    require(!volume.patches.empty(), "a Bézier volume has a patch");
    require(!volume.bounds().isEmpty(), "a Bézier volume has bounds");
    writeBezierVolume(file, volume);
    require(render::readBezierVolume(file).bytes() == volume.bytes(),
            "a Bézier volume is read as it was written");
  });
}

void readQuadrics(std::string_view bytes) {
  const std::filesystem::path file = scratchFile("quadrics.json", bytes);
  accepts([&] {
    const render::QuadricModel model = render::readQuadrics(file, kMaxMemory);
    const std::size_t count = model.balls.size() + model.sticks.size() + model.quadrics.size();
    require(count > 0, "a file of quadrics has one");
    writeQuadrics(file, model);
    const render::QuadricModel again = render::readQuadrics(file);
    require(again.balls.size() + again.sticks.size() + again.quadrics.size() == count,
            "quadrics are read as they were written");
  });
}

void readMolecule(std::string_view bytes, const char* format) {
  const std::filesystem::path file = scratchFile("molecule", bytes);
  accepts([&] {
    const levelset::Molecule molecule =
        levelset::readMolecule(file, {.format = format, .maxMemory = kMaxMemory});
    require(!molecule.atoms.empty(), "a molecule has an atom");
    for (const levelset::Atom& atom : molecule.atoms)
      require(atom.residue < molecule.residues.size() &&
                  molecule.residues[atom.residue].chain < molecule.chains.size(),
              "an atom is in a residue, and that in a chain");
  });
}

void readPdb(std::string_view bytes) {
  readMolecule(bytes, "pdb");
}

void readCif(std::string_view bytes) {
  readMolecule(bytes, "cif");
}

/// Writes the level set, the mesh and the volume that the scenes of the corpus name.
void writeSceneParts() {
  const levelset::NarrowBand ball = levelset::makeSphere(1, Imath::V3d(0), 0.25);
  levelset::writeBand(scratchFile("ball.vdb", ""), ball);
  levelset::TriMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
  levelset::writeMesh(scratchFile("corner.ply", ""), mesh);
  static_cast<void>(
      scratchFile("ramp.mha",
                  "ObjectType = Image\nNDims = 3\nBinaryData = False\nDimSize = 2 2 2\n"
                  "ElementType = MET_UCHAR\nElementDataFile = LOCAL\n1 2 3 4 5 6 7 8\n"));
}

void readScene(std::string_view bytes) {
  static const bool areWritten = (writeSceneParts(), true);
  static_cast<void>(areWritten);
  const std::filesystem::path file = scratchFile("scene.json", bytes);
  accepts([&] { static_cast<void>(render::readScene(file, {.maxMemory = kMaxMemory})); });
}

/// Reads a cache entry. `bytes` are its description, a zero byte, and the bytes of a mesh; the
/// digest is computed here.
void readCache(std::string_view bytes) {
  static const std::filesystem::path folder = scratchFile("place", "").parent_path() / "cache";
  static const pipeline::Cache cache(folder);
  const std::size_t zero = std::min(bytes.find('\0'), bytes.size());
  const std::string description(bytes.substr(0, zero)),
      content(bytes.substr(std::min(zero + 1, bytes.size())));
  static_cast<void>(scratchFile("cache/results/key.json", description));
  static_cast<void>(scratchFile("cache/results/key.mesh", pipeline::digestOf(content) + content));
  static_cast<void>(scratchFile("cache/results/key.vdb", content));
  accepts([&] {
    static_cast<void>(cache.step("key"));
    static_cast<void>(cache.value("key", kMaxMemory));
    static_cast<void>(cache.list());
  });
}

}  // namespace

std::vector<Reader> documentReaders() {
  return {{"patch", readPatch},       {"lattice", readLattice}, {"bezier", readBezier},
          {"quadrics", readQuadrics}, {"pdb", readPdb},         {"cif", readCif},
          {"scene", readScene},       {"cache", readCache}};
}

}  // namespace fuzz
