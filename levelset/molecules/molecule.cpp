#include "levelset/molecules/molecule.h"

#include <fmt/core.h>

#include <algorithm>

namespace levelset {
namespace {

constexpr std::array<std::string_view, 119> kSymbols = {
    "",   "H",  "He", "Li", "Be", "B",  "C",  "N",  "O",  "F",  "Ne", "Na", "Mg", "Al", "Si",
    "P",  "S",  "Cl", "Ar", "K",  "Ca", "Sc", "Ti", "V",  "Cr", "Mn", "Fe", "Co", "Ni", "Cu",
    "Zn", "Ga", "Ge", "As", "Se", "Br", "Kr", "Rb", "Sr", "Y",  "Zr", "Nb", "Mo", "Tc", "Ru",
    "Rh", "Pd", "Ag", "Cd", "In", "Sn", "Sb", "Te", "I",  "Xe", "Cs", "Ba", "La", "Ce", "Pr",
    "Nd", "Pm", "Sm", "Eu", "Gd", "Tb", "Dy", "Ho", "Er", "Tm", "Yb", "Lu", "Hf", "Ta", "W",
    "Re", "Os", "Ir", "Pt", "Au", "Hg", "Tl", "Pb", "Bi", "Po", "At", "Rn", "Fr", "Ra", "Ac",
    "Th", "Pa", "U",  "Np", "Pu", "Am", "Cm", "Bk", "Cf", "Es", "Fm", "Md", "No", "Lr", "Rf",
    "Db", "Sg", "Bh", "Hs", "Mt", "Ds", "Rg", "Cn", "Nh", "Fl", "Mc", "Lv", "Ts", "Og"};

struct ElementRadius {
  int element;
  double radius;
};
// [Bondi64, table I and II] and [Mantina09, table 12].
constexpr ElementRadius kRadii[] = {
    {1, 1.20},  {2, 1.40},  {3, 1.81},  {4, 1.53},  {5, 1.92},  {6, 1.70},  {7, 1.55},  {8, 1.52},
    {9, 1.47},  {10, 1.54}, {11, 2.27}, {12, 1.73}, {13, 1.84}, {14, 2.10}, {15, 1.80}, {16, 1.80},
    {17, 1.75}, {18, 1.88}, {19, 2.75}, {20, 2.31}, {28, 1.63}, {29, 1.40}, {30, 1.39}, {31, 1.87},
    {32, 2.11}, {33, 1.85}, {34, 1.90}, {35, 1.83}, {36, 2.02}, {37, 3.03}, {38, 2.49}, {46, 1.63},
    {47, 1.72}, {48, 1.58}, {49, 1.93}, {50, 2.17}, {51, 2.06}, {52, 2.06}, {53, 1.98}, {54, 2.16},
    {55, 3.43}, {56, 2.68}, {78, 1.75}, {79, 1.66}, {80, 1.55}, {81, 1.96}, {82, 2.02}, {83, 2.07},
    {84, 1.97}, {85, 2.02}, {86, 2.20}, {87, 3.48}, {88, 2.83}, {92, 1.86}};

// [Cordero08, table 2], 0.01 Å, from hydrogen to curium.
constexpr std::array<std::uint16_t, 96> kCovalentRadii = {
    31,  28,  128, 96,  84,  76,  71,  66,  57,  58,  166, 141, 121, 111, 107, 105,
    102, 106, 203, 176, 170, 160, 153, 139, 139, 132, 126, 124, 132, 122, 122, 120,
    119, 120, 120, 116, 220, 195, 190, 175, 164, 154, 147, 146, 142, 139, 145, 144,
    142, 139, 139, 138, 139, 140, 244, 215, 207, 204, 203, 201, 199, 198, 198, 196,
    194, 192, 192, 189, 190, 187, 187, 175, 170, 162, 151, 144, 141, 136, 136, 132,
    145, 146, 148, 140, 150, 150, 260, 221, 215, 206, 200, 196, 190, 187, 180, 169};

// [Jmol], red, green and blue in a byte each, from hydrogen to meitnerium.
constexpr std::array<std::uint32_t, 109> kColours = {
    0xffffff, 0xd9ffff, 0xcc80ff, 0xc2ff00, 0xffb5b5, 0x909090, 0x3050f8, 0xff0d0d, 0x90e050,
    0xb3e3f5, 0xab5cf2, 0x8aff00, 0xbfa6a6, 0xf0c8a0, 0xff8000, 0xffff30, 0x1ff01f, 0x80d1e3,
    0x8f40d4, 0x3dff00, 0xe6e6e6, 0xbfc2c7, 0xa6a6ab, 0x8a99c7, 0x9c7ac7, 0xe06633, 0xf090a0,
    0x50d050, 0xc88033, 0x7d80b0, 0xc28f8f, 0x668f8f, 0xbd80e3, 0xffa100, 0xa62929, 0x5cb8d1,
    0x702eb0, 0x00ff00, 0x94ffff, 0x94e0e0, 0x73c2c9, 0x54b5b5, 0x3b9e9e, 0x248f8f, 0x0a7d8c,
    0x006985, 0xc0c0c0, 0xffd98f, 0xa67573, 0x668080, 0x9e63b5, 0xd47a00, 0x940094, 0x429eb0,
    0x57178f, 0x00c900, 0x70d4ff, 0xffffc7, 0xd9ffc7, 0xc7ffc7, 0xa3ffc7, 0x8fffc7, 0x61ffc7,
    0x45ffc7, 0x30ffc7, 0x1fffc7, 0x00ff9c, 0x00e675, 0x00d452, 0x00bf38, 0x00ab24, 0x4dc2ff,
    0x4da6ff, 0x2194d6, 0x267dab, 0x266696, 0x175487, 0xd0d0e0, 0xffd123, 0xb8b8d0, 0xa6544d,
    0x575961, 0x9e4fb5, 0xab5c00, 0x754f45, 0x428296, 0x420066, 0x007d00, 0x70abfa, 0x00baff,
    0x00a1ff, 0x008fff, 0x0080ff, 0x006bff, 0x545cf2, 0x785ce3, 0x8a4fe3, 0xa136d4, 0xb31fd4,
    0xb31fba, 0xb30da6, 0xbd0d87, 0xc70066, 0xcc0059, 0xd1004f, 0xd90045, 0xe00038, 0xe6002e,
    0xeb0026};

char lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c | 0x20) : c;
}

}  // namespace

Imath::Box3d Molecule::bounds() const {
  Imath::Box3d box;
  for (const Atom& atom : atoms) {
    const Imath::V3d radius(vanDerWaalsRadius(atom.element));
    box.extendBy(atom.position - radius);
    box.extendBy(atom.position + radius);
  }
  return box;
}

std::size_t Molecule::bytes() const {
  return sizeof(Atom) * atoms.capacity() + sizeof(Residue) * residues.capacity() +
         sizeof(std::string) * chains.capacity() + sizeof(Bond) * bonds.capacity();
}

std::string Molecule::residueName(std::size_t residue) const {
  const Residue& of = residues[residue];
  return fmt::format("{}/{} {}{}", chains[of.chain], of.name, of.number, of.insertion);
}

double vanDerWaalsRadius(int element) {
  const int asked = element == 0 ? 6 : element;
  const auto* found = std::find_if(std::begin(kRadii), std::end(kRadii),
                                   [&](const ElementRadius& r) { return r.element == asked; });
  return found != std::end(kRadii) ? found->radius : 2;
}

double covalentRadius(int element) {
  const auto index = static_cast<std::size_t>(element == 0 ? 6 : element) - 1;
  return 0.01 * kCovalentRadii[std::min(index, kCovalentRadii.size() - 1)];
}

Imath::C3f elementColour(int element) {
  const auto index = static_cast<std::size_t>(element == 0 ? 6 : element) - 1;
  const std::uint32_t bytes = kColours[std::min(index, kColours.size() - 1)];
  const auto part = [&](int shift) { return static_cast<float>(bytes >> shift & 0xff) / 255; };
  return {part(16), part(8), part(0)};
}

int atomicNumber(std::string_view symbol) {
  if (symbol.size() == 1 && lower(symbol[0]) == 'd') return 1;
  for (std::size_t n = 1; n < kSymbols.size(); ++n)
    if (std::equal(symbol.begin(), symbol.end(), kSymbols[n].begin(), kSymbols[n].end(),
                   [](char a, char b) { return lower(a) == lower(b); }))
      return static_cast<int>(n);
  return 0;
}

std::string_view elementSymbol(int element) {
  return kSymbols[static_cast<std::size_t>(std::clamp(element, 0, 118))];
}

}  // namespace levelset
