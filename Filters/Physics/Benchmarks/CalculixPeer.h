// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// CalculiX (a Debian package, http://www.calculix.de) as the peer of the tissue solver: the same block on the same cells, as
// bricks with incompatible modes (C3D8I) of linear elasticity. It is handed over as a deck in a temporary folder, which is
// removed again.
#include "Filters/Physics/TissuePress.h"
#include "Testing/Benchmark.h"
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <unistd.h>

namespace echorama::benchmark {

/// What CalculiX found.
struct CalculixAnswer {
  std::vector<Eigen::Vector3d> displacements;      ///< of every node, mm
  Eigen::Vector3d force = Eigen::Vector3d::Zero(); ///< on the nodes whose displacements were given, N
  double seconds = 0.0;
};

inline bool HasCalculix()
{
  return std::system("command -v ccx >/dev/null 2>&1") == 0;
}

/// Solves for a block without empty cells that is fixed at its last layer along z, with weight and with nodes that are displaced.
/// \param moved displacements by the index of the node, mm
inline std::optional<CalculixAnswer> SolveWithCalculix(const TissueBody& body, const Eigen::Vector3d& gravity,
                                                       const std::map<std::size_t, Eigen::Vector3d>& moved)
{
  char name[] = "/tmp/calculix-XXXXXX";
  if (!mkdtemp(name))
    return std::nullopt;
  const std::string folder = name;
  const auto& n = body.nodes.dimensions;
  const auto number = [&n](int i, int j, int k) { return (k * n[1] + j) * n[0] + i + 1; };
  {
    std::ofstream deck(folder + "/block.inp");
    deck.precision(12);
    deck << "*NODE, NSET=ALL\n";
    ForNodes(n, [&](int i, int j, int k) {
      const Eigen::Vector3d at = body.nodes.spacing.cwiseProduct(Eigen::Vector3d(i, j, k));
      deck << number(i, j, k) << ", " << at.x() << ", " << at.y() << ", " << at.z() << '\n';
    });
    for (std::size_t material = 0; material < body.materials.size(); ++material) {
      deck << "*ELEMENT, TYPE=C3D8I, ELSET=E" << material << '\n';
      std::size_t cell = 0;
      ForNodes({n[0] - 1, n[1] - 1, n[2] - 1}, [&](int i, int j, int k) {
        if (body.cells[cell++] != static_cast<int>(material))
          return;
        deck << cell;
        for (const int up : {0, 1})
          for (const auto& corner : {std::array<int, 2>{0, 0}, {1, 0}, {1, 1}, {0, 1}})
            deck << ", " << number(i + corner[0], j + corner[1], k + up);
        deck << '\n';
      });
      const TissueMaterial& m = body.materials[material];
      deck << "*MATERIAL, NAME=M" << material << "\n*ELASTIC\n"
           << m.youngKPa << ", " << m.poisson << "\n*DENSITY\n"
           << 1e-3 * m.densityGPerCm3 << "\n*SOLID SECTION, ELSET=E" << material << ", MATERIAL=M" << material << '\n';
    }
    deck << "*NSET, NSET=BACK, GENERATE\n"
         << number(0, 0, n[2] - 1) << ", " << number(n[0] - 1, n[1] - 1, n[2] - 1) << "\n*BOUNDARY\nBACK, 1, 3\n";
    if (!moved.empty()) {
      deck << "*NSET, NSET=MOVED\n";
      for (const auto& entry : moved)
        deck << entry.first + 1 << '\n';
    }
    deck << "*STEP\n*STATIC\n";
    if (!gravity.isZero())
      for (std::size_t material = 0; material < body.materials.size(); ++material)
        deck << "*DLOAD\nE" << material << ", GRAV, " << gravity.norm() << ", " << gravity.normalized().x() << ", "
             << gravity.normalized().y() << ", " << gravity.normalized().z() << '\n';
    if (!moved.empty())
      deck << "*BOUNDARY\n";
    for (const auto& [node, by] : moved)
      for (int axis = 0; axis < 3; ++axis)
        deck << node + 1 << ", " << axis + 1 << ", " << axis + 1 << ", " << by[axis] << '\n';
    deck << "*NODE PRINT, NSET=ALL\nU\n";
    if (!moved.empty())
      deck << "*NODE PRINT, NSET=MOVED, TOTALS=ONLY\nRF\n";
    deck << "*END STEP\n";
  }
  CalculixAnswer answer;
  int status = 0;
  answer.seconds = Seconds([&] { status = std::system(("cd " + folder + " && ccx block >ccx.log 2>&1").c_str()); });
  std::ifstream results(folder + "/block.dat");
  answer.displacements.resize(body.nodes.VoxelCount());
  std::size_t found = 0;
  bool isForce = false;
  for (std::string line; std::getline(results, line);) {
    if (line.find("force") != std::string::npos)
      isForce = true;
    std::istringstream numbers(line);
    Eigen::Vector3d value;
    std::size_t node = 0;
    if (isForce && numbers >> value[0] >> value[1] >> value[2])
      answer.force = 1e-3 * value;
    else if (!isForce && numbers >> node >> value[0] >> value[1] >> value[2] && node > 0 && node <= answer.displacements.size()) {
      answer.displacements[node - 1] = value;
      ++found;
    }
  }
  std::error_code ignored;
  std::filesystem::remove_all(folder, ignored);
  if (status != 0 || found != answer.displacements.size())
    return std::nullopt;
  return answer;
}

} // namespace echorama::benchmark
