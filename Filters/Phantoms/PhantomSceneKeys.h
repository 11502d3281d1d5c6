// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The keys of a phantom's bodies, for its own text and for scenes of which they are an item (Core/Base/DescribedJson.h).
#include "Core/Base/DescribedJson.h"
#include "PhantomScene.h"

namespace echorama {

template <class A>
void Describe(A& a, Ellipsoid& ellipsoid)
{
  for (const Parameter& parameter : Describe(ellipsoid))
    a.Value(parameter, parameter.name == "Rotation" ? Presence::Optional : Presence::Needed);
}

template <class A>
void Describe(A& a, Tube& tube)
{
  a.Numbers("path", tube.path, {-1e6, 1e6}, "mm", "Points in the world, at least two.", Presence::Needed);
  for (const Parameter& parameter : Describe(tube))
    a.Value(parameter, Presence::Needed);
}

template <class A>
void Describe(A& a, Inclusion& inclusion)
{
  a.Value(Parameter("Name", inclusion.name, "Of the body."));
  a.OneOf(inclusion.shape, Form<Ellipsoid>{"ellipsoid", "A turned ellipsoid."}, Form<Tube>{"tube", "A bent vessel."});
  Each(a, Describe(inclusion));
}

template <class A>
void Describe(A& a, PhantomScene& scene)
{
  a.List("inclusions", scene.inclusions, "The bodies; where several hold a point the later counts.");
}

} // namespace echorama
