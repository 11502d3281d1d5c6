// SPDX-License-Identifier: BSD-3-Clause
// What comes into the simulator and what leaves it: trackers, recordings, replays, OpenIGTLink.
#include "Core/Base/Error.h"
#include "JobBar.h"
#include "NeedleTool.h"
#include "OutputPanel.h"
#include "ScanLog.h"
#include "SimulatorUnderTest.h"
#include "Tracking/Stream/SequenceRecorder.h"
#include "VolumeReading.h"
#include <atomic>
#include <QCheckBox>
#include <QCryptographicHash>
#include <QDoubleSpinBox>
#include <QLabel>
#include <QLineEdit>
#include <QProcess>
#include <QPushButton>
#include <QSlider>
#include <QToolButton>
#include <QtTest>
#include <sys/syscall.h>
#include <unistd.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkUltrasoundSequenceReader.h>
#include <vtkUltrasoundTrackerSource.h>
#include <vtkUltrasoundVolume.h>
#include <vtkUltrasoundVolumeReconstructor.h>

using namespace echorama;

class TestScanStreams : public FolderTest {
  Q_OBJECT

private slots:
  void aTrackedToolIsTheProbeUntilItStops();
  void aRecordedScanReplaysToTheLastBit();
  void closingEndsARecording();
  void aRecordingOfAnotherBodyIsRefused();
  void aDamagedRecordingIsNamed();
  void aRecordedSweepGivesTheVolumeBack();
  void aCrashLeavesNoLineWithoutItsImage();
  void aFlippedImageIsRecordedAsItIsShown();
  void imagesAreComparedInTheBackground();
  void theSumOfASceneIsOfAllOfIt();
  void imageAndPoseAreSent();

private:
  struct Likeness {
    double rms = 1e9, share = 0.0; ///< grey levels; of the middle of the body
    int voxels = 0;
  };
  static Likeness BesideField(vtkImageData* volume);
  static double Field(const Eigen::Vector3d& at)
  {
    return 120.0 + 50.0 * std::sin(0.12 * at[0]) * std::cos(0.1 * at[1]) + 0.8 * at[2];
  }
};

namespace {
std::atomic<int> JoinedOnDisk{0}; // recordings whose parts were still there then
}

// Takes the place of the system's, for all libraries of this program.
extern "C" __attribute__((visibility("default"))) int fsync(int file)
{
  const QString path = QFile::symLinkTarget(QString("/proc/self/fd/%1").arg(file));
  if (path.endsWith(".igs.mha") && QFile::exists(path.left(path.size() - 1) + "d"))
    ++JoinedOnDisk;
  return static_cast<int>(syscall(SYS_fsync, file));
}

void TestScanStreams::aTrackedToolIsTheProbeUntilItStops()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  const Pose start = window.Scan().ProbeToWorld();
  Pose last = start;
  const QString log = Folder().filePath("log.igs.mha");
  {
    SequenceRecorder recorder(log.toStdString());
    for (int i = 0; i < 60; i++) { // 60 Hz for a second: 6 mm into the body
      SequenceFrame frame;
      frame.time = 10.0 + i / 60.0;
      last.translation() = start.translation() + start.linear().col(2) * 0.1 * i;
      frame.transforms.push_back({"ProbeToTracker", Eigen::Affine3d(last.matrix())});
      recorder.Append(frame);
    }
    recorder.Finish();
  }
  window.Type(window.Part<QLineEdit>("trackerAddress"), "replay:" + log);
  auto* connect = window.Part<QPushButton>("trackerConnect");
  connect->click();
  QTRY_VERIFY(window.Scan().IsFollowing());
  QTRY_VERIFY((window.Place() - last.translation()).norm() < 1e-6);
  QVERIFY(window.Scan().Cine().Count() > 5); // it was seen on its way
  // Then nothing comes any more, and the image says since when.
  QTRY_VERIFY_WITH_TIMEOUT(window.Image().IsStale(), 5000);
  QVERIFY2(window.Image().State().contains("stopped"), qPrintable(window.Image().State()));
  const QString before = window.Image().State();
  QTRY_VERIFY(window.Image().State() != before); // the seconds go on
  window.Grab("simulator-tracker");
  connect->click();
  window.Frame();
  QVERIFY(!window.Image().IsStale());
  QVERIFY(!window.Scan().IsFollowing());
  // A device that is not there is an error with its name.
  window.Type(window.Part<QLineEdit>("trackerAddress"), "replay:" + Folder().filePath("nowhere.igs.mha"));
  connect->click();
  QTRY_VERIFY(window.HasMessage("nowhere.igs.mha"));
  QCOMPARE(connect->text().remove('&'), QString("Connect"));
}

void TestScanStreams::aRecordedScanReplaysToTheLastBit()
{
  const QString file = body::Write(Folder(), "body.mha", Field);
  {
    SimulatorUnderTest window;
    QVERIFY(window.Open({file}));
    auto* output = window.Part<OutputPanel>("outputPanel");
    output->SetFolder(Folder());
    window.Scan().SetControl("NoiseDb", "-25");
    window.Scan().SetControl("NoiseMoves", "on");
    window.Frame();
    window.Part<QPushButton>("record")->click();
    QVERIFY(output->IsRecording());
    for (int i = 0; i < 30; i++) {
      if (i == 10)
        window.Scan().SetControl("GainDb", "4.3");
      if (i == 20)
        window.Key(Qt::Key_PageUp);
      if (i == 25)
        window.Key(Qt::Key_PageDown);
      window.Move(i % 2 ? Qt::Key_Right : Qt::Key_Up);
    }
    JoinedOnDisk = 0;
    window.Part<QPushButton>("record")->click();
    QVERIFY(window.Wait());
    QVERIFY(window.HasMessage("Recorded as"));
    QCOMPARE(JoinedOnDisk.load(), 1);                      // before its parts went
    QCOMPARE(Folder().entryList({"*.igs.mha"}).size(), 1); // one file, and no parts of it
    QVERIFY(Folder().entryList({"*.igs.mhd", "*.igs.raw"}).isEmpty());
  }
  const QStringList logs = Folder().entryList({"*.scan.jsonl"});
  QCOMPARE(logs.size(), 1);
  const QString path = Folder().filePath(logs[0]);
  const ScanLog log = ScanLog::Read(path);
  QVERIFY(log.entries.size() >= 30);
  SequenceFile sequence(Folder().filePath(Folder().entryList({"*.igs.mha"})[0]).toStdString());
  QCOMPARE(sequence.Content().frames, static_cast<int>(log.entries.size()));
  std::vector<char> pixels(sequence.Content().FrameBytes());
  for (const std::size_t i : {std::size_t(0), log.entries.size() - 1}) { // each image beside its line
    if (log.entries[i].frame.isInAir)
      continue;
    sequence.ReadFrame(static_cast<int>(i), pixels.data());
    QCOMPARE(
        QCryptographicHash::hash(QByteArray(pixels.data(), static_cast<int>(pixels.size())), QCryptographicHash::Md5).toHex(),
        log.entries[i].sum);
  }
  QVERIFY(log.entries.front().sum != log.entries.back().sum);
  SimulatorUnderTest window; // another day
  QVERIFY(window.Open({file}));
  window.Part<OutputPanel>("outputPanel")->Replay(path);
  QVERIFY(window.Wait());
  const QString count = QString::number(log.entries.size());
  QVERIFY2(window.HasMessage(count + " of " + count), qPrintable(window.Messages().join('\n')));
  QVERIFY(window.Scan().IsFrozen());
  QCOMPARE(window.Scan().Cine().Count(), static_cast<int>(log.entries.size()));
  window.Part<QSlider>("cineSlider")->setValue(7);
  window.Settle();
  QCOMPARE(SumOf(window.Scan().Scanner().Output()), log.entries[7].sum);
  window.Key(Qt::Key_Space);
  window.Frame();
  QVERIFY(!window.Scan().IsFrozen());
  QCOMPARE(window.Part<QDoubleSpinBox>("GainDb")->value(), 0.0); // as it was before the replay
  QVERIFY(window.Scan().Cine().Count() < 10);
}

void TestScanStreams::closingEndsARecording()
{
  {
    SimulatorUnderTest window;
    QVERIFY(window.Open({body::Write(Folder(), "body.mha", Field)}));
    window.Part<OutputPanel>("outputPanel")->SetFolder(Folder());
    window.Part<QPushButton>("record")->click();
    window.Move(Qt::Key_Right, Qt::NoModifier, 3);
  }
  const QStringList sequences = Folder().entryList({"*.igs.mhd"}), logs = Folder().entryList({"*.scan.jsonl"});
  QCOMPARE(sequences.size(), 1);
  SequenceFile sequence(Folder().filePath(sequences[0]).toStdString());
  QVERIFY(sequence.Content().frames >= 2);
  QCOMPARE(sequence.Content().frames, static_cast<int>(ScanLog::Read(Folder().filePath(logs[0])).entries.size()));
}

void TestScanStreams::aRecordingOfAnotherBodyIsRefused()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::Write(Folder(), "body.mha", Field)}));
  window.Part<OutputPanel>("outputPanel")->SetFolder(Folder());
  window.Part<QPushButton>("record")->click();
  window.Move(Qt::Key_Right);
  window.Part<QPushButton>("record")->click();
  QVERIFY(window.Open({body::WriteWithBall(Folder(), "other.mha")}));
  window.Part<OutputPanel>("outputPanel")->Replay(Folder().filePath(Folder().entryList({"*.scan.jsonl"})[0]));
  QVERIFY(window.Wait());
  QVERIFY2(window.HasMessage("another body"), qPrintable(window.Messages().join('\n')));
  QVERIFY(window.HasMessage("body.mha"));
  QVERIFY(!window.Scan().IsFrozen());
}

void TestScanStreams::aDamagedRecordingIsNamed()
{
  const QString path = Folder().filePath("a.scan.jsonl");
  const QByteArray head = "{\"schema\":\"echorama-scan-2\",\"volumes\":[\"a.mha\"],\"body\":\"0\"}\n";
  const QByteArray frame =
      "{\"ProbeToWorld\":[1,0,0,0,0,1,0,0,0,0,1,0],\"seconds\":1,\"number\":1,\"sum\":\"0\",\"controls\":{}}\n";
  const auto read = [&](const QByteArray& text) -> QString {
    QFile file(path);
    if (!file.open(QIODevice::WriteOnly))
      return "it cannot be written";
    file.write(text);
    file.close();
    try {
      return QString::number(ScanLog::Read(path).entries.size());
    } catch (const Error& error) {
      return QString::fromUtf8(error.what());
    }
  };
  QCOMPARE(read(head + frame), QString("1"));
  QCOMPARE(read(head + frame + frame.left(30)), QString("1")); // cut off by a crash
  QVERIFY(read(head).contains("no frame"));
  QVERIFY(read(frame).contains("not a recorded scan"));
  QVERIFY(read(head + frame + "{\n").contains("line 3"));
  QByteArray sheared = frame;
  sheared.replace("[1,0,0,0", "[1,1,0,0");
  QVERIFY(read(head + sheared).contains("no rigid pose"));
  QByteArray without = frame;
  without.replace("controls", "control");
  QVERIFY(read(head + without).contains("no controls"));
  for (const char* number : {"1e300", "-1", "1.5"}) {
    QByteArray other = frame;
    other.replace("\"number\":1", QByteArray("\"number\":") + number);
    QVERIFY2(read(head + other).contains("line 2: its number"), number);
  }
}

void TestScanStreams::aRecordedSweepGivesTheVolumeBack()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::Write(Folder(), "body.mha", Field)}));
  window.Part<OutputPanel>("outputPanel")->SetFolder(Folder());
  window.Scan().SetControl("DepthMm", "80");
  for (const auto& [thickness, rms] : {std::pair<const char*, double>{"0", 0.8}, {"3", 0.8}}) {
    window.Scan().SetControl("ThicknessMm", thickness);
    window.Scan().PlaceAtTop();
    window.Move(Qt::Key_Down, Qt::ShiftModifier, 2);
    window.Part<QPushButton>("record")->click();
    for (int i = 0; i < 40; i++) {
      window.Scan().Slide(0.0, -1.0);
      window.Frame();
    }
    window.Part<QPushButton>("record")->click();
    QVERIFY(window.Wait());
    const QStringList sweeps = Folder().entryList({"scan-*.igs.mha"}, QDir::Files, QDir::Name);
    vtkNew<vtkUltrasoundSequenceReader> reader;
    reader->SetFileName(Folder().filePath(sweeps.last()).toUtf8());
    vtkNew<vtkUltrasoundVolumeReconstructor> reconstructor;
    reconstructor->SetInputConnection(reader->GetOutputPort());
    reconstructor->SetSectorToDetected();
    reconstructor->SetParameter("SpacingMm", 1.0);
    reconstructor->Update();
    const Likeness likeness = BesideField(reconstructor->GetOutput());
    qInfo("thickness %s mm: RMS error %.2f grey levels over %d voxels, %.1f %% of the middle", thickness, likeness.rms,
          likeness.voxels, 100 * likeness.share);
    QVERIFY(likeness.share > 0.98);
    QVERIFY(likeness.rms < rms);
#ifdef ECHORAMA_PROGRAM
    // The same by the command line, with nothing but what a user gives.
    const QString out = Folder().filePath(QString("volume-%1.mha").arg(thickness));
    QProcess program;
    program.start(ECHORAMA_PROGRAM, {"reconstruct", Folder().filePath(sweeps.last()), "-o", out, "--spacing", "1"});
    QVERIFY(program.waitForFinished(120000));
    QVERIFY2(program.exitStatus() == QProcess::NormalExit && program.exitCode() == 0, program.readAllStandardError());
    const std::vector<ReadVolume> volumes = ReadVolumes({out}, {});
    QVERIFY2(volumes[0].image, qPrintable(volumes[0].error));
    const Likeness told = BesideField(volumes[0].image);
    qInfo("echorama reconstruct, thickness %s mm: RMS error %.2f grey levels over %d voxels, %.1f %% of the middle", thickness,
          told.rms, told.voxels, 100 * told.share);
    QVERIFY(told.share > 0.98);
    QVERIFY(told.rms < rms);
#endif
  }
}

TestScanStreams::Likeness TestScanStreams::BesideField(vtkImageData* volume)
{
  Likeness likeness;
  vtkDataArray* grey = vtkUltrasoundVolume::GetIntensity(volume);
  vtkDataArray* valid = vtkUltrasoundVolume::GetValidRegion(volume);
  if (!grey || !valid)
    return likeness;
  const ImageGeometry geometry = vtkUltrasoundVolume::GeometryOf(volume);
  double squares = 0.0;
  int inside = 0;
  vtkIdType i = 0;
  for (int z = 0; z < geometry.dimensions[2]; z++)
    for (int y = 0; y < geometry.dimensions[1]; y++)
      for (int x = 0; x < geometry.dimensions[0]; x++, i++) {
        const Eigen::Vector3d at = geometry.IndexToWorld() * Eigen::Vector3d(x, y, z);
        if (body::Level(at) > 0.8 || std::abs(at[2]) > 8.0 || std::abs(at[0]) > 12.0)
          continue;
        inside++;
        if (valid->GetComponent(i, 0) == 0.0)
          continue;
        const double off = grey->GetComponent(i, 0) - Field(at);
        squares += off * off;
        likeness.voxels++;
      }
  if (likeness.voxels > 0) {
    likeness.rms = std::sqrt(squares / likeness.voxels);
    likeness.share = static_cast<double>(likeness.voxels) / inside;
  }
  return likeness;
}

void TestScanStreams::aCrashLeavesNoLineWithoutItsImage()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::Write(Folder(), "body.mha", Field)}));
  window.Part<OutputPanel>("outputPanel")->SetFolder(Folder());
  window.Part<QPushButton>("record")->click();
  const QString name = Folder().filePath(Folder().entryList({"*.scan.jsonl"})[0]).remove(".scan.jsonl");
  // What a crash would leave is what is in the files.
  const auto left = [&name] {
    const int lines = static_cast<int>(ScanLog::Read(name + ".scan.jsonl").entries.size());
    return std::pair<int, int>(lines, SequenceFile((name + ".igs.mhd").toStdString()).Content().frames);
  };
  for (int i = 0; i < 12; i++) {
    window.Scan().Slide(1.0, 0.0);
    window.Scan().MakeNow();
    const auto [lines, frames] = left();
    QCOMPARE(lines, frames);
  }
  // And when the probe rests, all is there after a while.
  const int all = window.Scan().Cine().Count();
  QVERIFY(all >= 12);
  QTRY_VERIFY_WITH_TIMEOUT(left().second >= 13, 3000);
  QCOMPARE(left().first, left().second);
}

void TestScanStreams::aFlippedImageIsRecordedAsItIsShown()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::WriteWithBall(Folder())}));
  window.Part<OutputPanel>("outputPanel")->SetFolder(Folder());
  window.Move(Qt::Key_Right, Qt::ControlModifier, 5); // the ball is left of the middle
  window.Part<QPushButton>("record")->click();
  window.Key(Qt::Key_F);
  window.Frame();
  window.Part<QPushButton>("record")->click();
  QVERIFY(window.Wait());
  SequenceFile sequence(Folder().filePath(Folder().entryList({"*.igs.mha"})[0]).toStdString());
  const ScanLog log = ScanLog::Read(Folder().filePath(Folder().entryList({"*.scan.jsonl"})[0]));
  const int last = sequence.Content().frames - 1;
  QVERIFY(last >= 1);
  QVERIFY(!log.entries.front().frame.isFlipped && log.entries.back().frame.isFlipped);
  std::vector<unsigned char> pixels(sequence.Content().FrameBytes());
  double column[2];
  for (int i : {0, 1}) {
    const SequenceFrame frame = sequence.Frame(i * last);
    sequence.ReadFrame(i * last, pixels.data());
    // Its matrix says where the ball, which is at the origin of the world, lies in its pixels: there it is.
    const Eigen::Vector3d at = frame.Find("ImageToReference")->matrix.inverse() * Eigen::Vector3d::Zero();
    QVERIFY(std::abs(at[2]) < 3.0); // in the plane
    column[i] = at[0];
    const auto width = static_cast<std::size_t>(sequence.Content().dimensions[0]);
    QVERIFY(pixels[static_cast<std::size_t>(std::lround(at[1])) * width + static_cast<std::size_t>(std::lround(at[0]))] > 220);
  }
  QVERIFY2(std::abs(column[0] + column[1] - (sequence.Content().dimensions[0] - 1)) < 0.01,
           "the one is the other's mirror image");
  QVERIFY(column[1] > column[0] + 20.0);
  // It replays, however the image is shown then.
  window.Part<OutputPanel>("outputPanel")->Replay(Folder().filePath(Folder().entryList({"*.scan.jsonl"})[0]));
  QVERIFY(window.Wait());
  const QString count = QString::number(log.entries.size());
  QVERIFY2(window.HasMessage(count + " of " + count), qPrintable(window.Messages().join('\n')));
}

void TestScanStreams::imagesAreComparedInTheBackground()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::Write(Folder(), "body.mha", Field)}));
  auto* output = window.Part<OutputPanel>("outputPanel");
  output->SetFolder(Folder());
  window.Scan().SetControl("ThicknessPlanes", "33"); // which takes its time
  window.Scan().SetControl("Beams", "512");
  window.Frame();
  window.Part<QPushButton>("record")->click();
  for (int i = 0; i < 20; i++) {
    window.Scan().Slide(i % 2 ? 1.0 : -1.0, 0.0);
    window.Scan().MakeNow();
  }
  window.Part<QPushButton>("record")->click();
  QVERIFY(window.Wait());
  const QString path = Folder().filePath(Folder().entryList({"*.scan.jsonl"})[0]);
  const auto labels = [&window] { return window.Part<JobBar>("jobBar")->Labels().join(' '); };
  output->Replay(path);
  QVERIFY(!window.Scan().IsFrozen()); // it is being read
  QTRY_VERIFY(labels().contains("Comparing") && window.Part<JobBar>("jobBar")->Count() == 1);
  window.Settle();
  QVERIFY(window.Scan().IsFrozen());
  // Meanwhile the frames can be gone through; and it can be stopped.
  window.Part<QSlider>("cineSlider")->setValue(3);
  QCOMPARE(window.Scan().CineIndex(), 3);
  QVERIFY2(labels().contains("Comparing"), "the window is not blocked until all are compared");
  window.Part<QToolButton>("jobCancel")->click();
  QVERIFY(window.Wait());
  QVERIFY2(window.HasMessage("were not compared"), qPrintable(window.Messages().join('\n')));
  QVERIFY(window.Scan().IsFrozen());
  QCOMPARE(window.Scan().CineIndex(), 3);
  // What is written in the recording counts: one sum that is not right is told.
  QFile file(path);
  QVERIFY(file.open(QIODevice::ReadOnly));
  QByteArray text = file.readAll();
  file.close();
  text.replace(text.lastIndexOf("\"sum\":\"") + 7, 4, "0000");
  QVERIFY(file.open(QIODevice::WriteOnly));
  file.write(text);
  file.close();
  const int all = static_cast<int>(ScanLog::Read(path).entries.size());
  output->Replay(path);
  QVERIFY(window.Wait());
  QVERIFY2(window.HasMessage(QString("%1 of %2 images").arg(all - 1).arg(all)), qPrintable(window.Messages().join('\n')));
}

void TestScanStreams::theSumOfASceneIsOfAllOfIt()
{
  const Subject bone = ReadSubject({body::WriteScene(Folder())}, {}, {});
  const Subject stone = ReadSubject({body::WriteScene(Folder(), "other.json", "stone")}, {}, {});
  QCOMPARE(SumOf(bone), SumOf(ReadSubject({body::WriteScene(Folder())}, {}, {})));
  QVERIFY(SumOf(bone) != SumOf(stone));      // the surfaces are the same
  QCOMPARE(SumOf(bone, 1), SumOf(stone, 1)); // which is why there is a second version
  Subject turned = bone;
  turned.tissue = vtkSmartPointer<vtkPolyData>::New();
  turned.tissue->DeepCopy(bone.tissue);
  QCOMPARE(SumOf(turned), SumOf(bone));
  turned.tissue->ReverseCell(0);
  QVERIFY(SumOf(turned) != SumOf(bone));
  // Of a volume the region that is valid counts, too.
  Subject volume = ReadSubject({body::Write(Folder(), "body.mha", Field)}, {}, {});
  const QByteArray before = SumOf(volume);
  vtkDataArray* valid = vtkUltrasoundVolume::GetValidRegion(volume.volumes[0]);
  QVERIFY(valid);
  valid->SetComponent(0, 0, 1.0 - valid->GetComponent(0, 0));
  QVERIFY(SumOf(volume) != before);

  // A recording of the first version replays, by its own sum.
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::Write(Folder(), "body.mha", Field)}));
  auto* output = window.Part<OutputPanel>("outputPanel");
  output->SetFolder(Folder());
  window.Part<QPushButton>("record")->click();
  window.Move(Qt::Key_Right);
  window.Part<QPushButton>("record")->click();
  QVERIFY(window.Wait());
  const QString path = Folder().filePath(Folder().entryList({"*.scan.jsonl"})[0]);
  QFile file(path);
  QVERIFY(file.open(QIODevice::ReadOnly));
  QByteArray text = file.readAll();
  file.close();
  QVERIFY(text.contains("echorama-scan-2") && text.contains(SumOf(window.Scan().Body())));
  text.replace("echorama-scan-2", "echorama-scan-1");
  const auto replays = [&] {
    if (!file.open(QIODevice::WriteOnly))
      return false;
    file.write(text);
    file.close();
    output->Replay(path);
    return window.Wait() && window.HasMessage("same to the last bit");
  };
  QVERIFY(!replays()); // the sum is not of that version
  QVERIFY(window.HasMessage("another body"));
  text.replace(SumOf(window.Scan().Body()), SumOf(window.Scan().Body(), 1));
  QVERIFY2(replays(), qPrintable(window.Messages().join('\n')));
}

void TestScanStreams::imageAndPoseAreSent()
{
  SimulatorUnderTest window;
  QVERIFY(window.Open({body::Write(Folder(), "body.mha", Field)}));
  window.Part<QDoubleSpinBox>("sendPort")->setValue(0);
  window.Part<QCheckBox>("send")->click();
  const int port = window.Part<OutputPanel>("outputPanel")->Sender()->GetListeningPort();
  QVERIFY(port > 0);
  vtkNew<vtkUltrasoundTrackerSource> client;
  client->SetDevice(QString("igtl://localhost:%1").arg(port).toUtf8());
  QVERIFY(client->Start());
  QTRY_COMPARE(window.Part<OutputPanel>("outputPanel")->Sender()->GetNumberOfClients(), 1);
  window.Move(Qt::Key_Right, Qt::ShiftModifier);
  vtkNew<vtkMatrix4x4> pose;
  const auto hasCome = [&] {
    client->Modified();
    client->Update();
    auto* image = vtkImageData::SafeDownCast(client->GetOutputDataObject(1));
    return client->GetTransform("ProbeToReference", pose) == 0 && image && image->GetNumberOfPoints() == 640 * 480 &&
           SumOf(image) == SumOf(window.Scan().Scanner().Output());
  };
  QTRY_VERIFY(hasCome());
  // Sent in R, A, S, as OpenIGTLink has it: x and y are negative there.
  const auto isAt = [&](const Eigen::Vector3d& place) {
    const Eigen::Vector3d came(pose->GetElement(0, 3), pose->GetElement(1, 3), pose->GetElement(2, 3));
    return (came - Eigen::Vector3d(-place[0], -place[1], place[2])).norm() < 1e-3;
  };
  QVERIFY(isAt(window.Place()));
  QVERIFY(client->GetTransform("NeedleToReference", pose) != 0); // there is none
  NeedleTool& needle = *window.Window().TheNeedle();
  needle.SetShown(true);
  needle.Advance(7.0);
  window.Scan().MakeNow();
  const Pose held = needle.Now().ToWorld();
  QTRY_VERIFY((client->Modified(), client->Update(), client->GetTransform("NeedleToReference", pose) == 0) &&
              isAt(held.translation()));
  QVERIFY(std::abs(pose->GetElement(2, 2) - held.linear()(2, 2)) < 1e-6); // and it points where it goes
  window.Part<QCheckBox>("send")->click();
  QCOMPARE(window.Part<OutputPanel>("outputPanel")->Sender()->GetListeningPort(), 0);
}

int main(int argc, char** argv)
{
  return RunWindowTest("SimulatorTest", argc, argv, [argc, argv] {
    TestScanStreams test;
    return QTest::qExec(&test, argc, argv);
  });
}

#include "TestScanStreams.moc"
