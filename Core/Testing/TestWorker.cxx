// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/Worker.h"
#include <cstddef>
#include <gtest/gtest.h>
#include <pthread.h>
#include <stdexcept>
#include <system_error>

using namespace echorama;

TEST(Worker, ThreadsThatCannotBeHad)
{
  pthread_attr_t usual, vast;
  ASSERT_EQ(pthread_getattr_default_np(&usual), 0);
  ASSERT_EQ(pthread_getattr_default_np(&vast), 0);
  ASSERT_EQ(pthread_attr_setstacksize(&vast, std::size_t{1} << 46), 0); // no machine has the address space for such a stack
  ASSERT_EQ(pthread_setattr_default_np(&vast), 0);
  Worker worker;
  EXPECT_THROW(worker.Start([](const Worker::Signal&) {}), std::system_error);
  pthread_setattr_default_np(&usual);
  EXPECT_FALSE(worker.Running());
  worker.Stop();
  worker.Start([](const Worker::Signal&) { throw std::runtime_error("and another time"); });
  while (worker.Running()) {
  }
  EXPECT_EQ(worker.Failure(), "and another time");
  pthread_attr_destroy(&usual);
  pthread_attr_destroy(&vast);
}
