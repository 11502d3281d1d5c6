// SPDX-License-Identifier: BSD-3-Clause
#include "WorkbenchKeys.h"
#include <QObject>

namespace echorama {

QVector<KeysOf> WorkbenchKeys()
{
  return {
      {QObject::tr("Mouse"),
       {
           {QObject::tr("Left"), QObject::tr("the tool in hand: move volumes, paint, carve, restore, mark, measure, or point")},
           {QObject::tr("Shift + left (Align)"), QObject::tr("turn volumes")},
           {QObject::tr("Wheel"), QObject::tr("through the slices (Shift: ten at a time)")},
           {QObject::tr("Ctrl + wheel"), QObject::tr("zoom")},
           {QObject::tr("Middle"), QObject::tr("move the picture")},
           {QObject::tr("Shift + middle"), QObject::tr("turn the plane of the slice")},
           {QObject::tr("Right"), QObject::tr("contrast (sideways) and brightness (up and down)")},
           {QObject::tr("Right, double click"), QObject::tr("brightness and contrast as they were at first")},
           {QObject::tr("Double click"), QObject::tr("make a view large, and back")},
       }},
      {QObject::tr("Moving volumes (tool Align)"),
       {
           {QObject::tr("x, y, z"),
            QObject::tr(
                "restrict motion to this axis; press again for the plane perpendicular to it, and again for free motion")},
           {QObject::tr("Arrows"), QObject::tr("move by one step in the view")},
           {QObject::tr("Page up, Page down"), QObject::tr("move by one step towards you, and away")},
           {QObject::tr("Ctrl + arrows, Ctrl + Page up, Page down"), QObject::tr("turn by one step")},
           {QObject::tr("+, -"), QObject::tr("double or halve the step size")},
           {QObject::tr("c"), QObject::tr("put the centre of rotation where the mouse is")},
           {QObject::tr("Shift + c"), QObject::tr("put it back in the middle of what is selected")},
           {QObject::tr("Escape"), QObject::tr("take a drag back, end flickering, or show all volumes again")},
       }},
      {QObject::tr("Typing in a field"),
       {
           {QObject::tr("Return"), QObject::tr("takes what was typed, and gives the keys back to the views")},
           {QObject::tr("Escape"), QObject::tr("brings back what was there before, and gives the keys back to the views")},
       }}};
}

} // namespace echorama
