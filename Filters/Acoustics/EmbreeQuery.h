// SPDX-License-Identifier: BSD-3-Clause
//
// What Embree 3 and Embree 4 name differently, and nothing else: the rest of Embree's interface is the same in both.
#pragma once
#include <rtcore.h>

namespace echorama {

#if RTC_VERSION_MAJOR < 4

/// Lets filters come with a query.
constexpr RTCSceneFlags embreeQueryFilters = RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION;

/// The context is the first member, so that a filter can turn its address into that of what it belongs to.
struct EmbreeQuery {
  RTCIntersectContext context;

  /// \param filter is called for every hit, if there is one
  void Ask(RTCScene scene, RTCRayHit& ray, RTCFilterFunctionN filter = nullptr)
  {
    rtcInitIntersectContext(&context);
    context.filter = filter;
    rtcIntersect1(scene, &context, &ray);
  }
};

#else

constexpr RTCSceneFlags embreeQueryFilters = RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS;

struct EmbreeQuery {
  RTCRayQueryContext context;

  void Ask(RTCScene scene, RTCRayHit& ray, RTCFilterFunctionN filter = nullptr)
  {
    rtcInitRayQueryContext(&context);
    RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.context = &context;
    arguments.filter = filter;
    arguments.flags = static_cast<RTCRayQueryFlags>(arguments.flags | RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER);
    rtcIntersect1(scene, &ray, &arguments);
  }
};

#endif

} // namespace echorama
