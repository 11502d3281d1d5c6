// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Base/VtkMessage.h"
#include <gtest/gtest.h>

using namespace echorama;

TEST(VtkMessage, BecomesASentence)
{
  EXPECT_EQ(SentenceOfVtkMessage("ERROR: In ../F/vtkX.cxx, line 12\nvtkX (0x5581): a.mha: it is empty\n\n"),
            "a.mha: it is empty");
  EXPECT_EQ(SentenceOfVtkMessage("Generic Warning: In /a b/vtkX.cxx, line 1\nfirst\nsecond\n\n"), "first second");
  EXPECT_EQ(SentenceOfVtkMessage("Warning: In vtkX.cxx, line 1\nsays vtkX (0x1): more"), "says vtkX (0x1): more");
  EXPECT_EQ(SentenceOfVtkMessage("ERROR: In nowhere"), "ERROR: In nowhere");
  EXPECT_EQ(SentenceOfVtkMessage("plain (0x1): words\n"), "plain (0x1): words");
  EXPECT_EQ(SentenceOfVtkMessage(""), "");
}

TEST(VtkMessage, TheReasonIsNotThatItFailed)
{
  EXPECT_EQ(ReasonAmong({}), "");
  EXPECT_EQ(ReasonAmong({"Algorithm vtkX returned failure for request: ...", "no volume", "other"}), "no volume");
  EXPECT_EQ(ReasonAmong({"Algorithm vtkX returned failure for request: ..."}),
            "Algorithm vtkX returned failure for request: ...");
}
