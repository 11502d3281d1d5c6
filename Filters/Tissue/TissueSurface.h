// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include "Core/Base/Progress.h"
#include "Material.h"
#include <array>
#include <cstdint>
#include <Eigen/Core>
#include <string>
#include <vector>

namespace echorama {

/// What lies in the world, as closed triangle surfaces that bound bodies of a material: the one form in which tissue reaches
/// the acoustics, whoever made it.
///
/// Bodies may touch, nest and overlap: where several hold a point, the one that comes last in the list counts. So an organ is
/// listed before its vessels, and a layer of skin may be the whole trunk, listed before the trunk without its skin. Where
/// there is no body there is the background.
struct TissueSurface {
  struct Body {
    std::string name; ///< may be empty
    int material = 0; ///< index into materials
  };

  std::vector<Eigen::Vector3f> points;                 ///< mm, world
  std::vector<std::array<std::uint32_t, 3>> triangles; ///< counter-clockwise as seen from outside
  std::vector<std::int32_t> bodyOfTriangle;            ///< index into bodies
  std::vector<Body> bodies;
  std::vector<Material> materials; ///< the first is the background's

  /// Throws Error(BadInput) when indices are out of range, lists do not agree, there is no material, or a point is not finite;
  /// and what Material::Check throws.
  void Check() const;

  /// The index of \a material in the list, which takes it in when no equal one is there.
  int MaterialIndex(const Material& material);

  /// Adds another's bodies after ours; its background is left out.
  void Append(const TissueSurface& other);

  /// One body alone, with all materials; -1 is none.
  TissueSurface Only(int body) const;
};

} // namespace echorama
