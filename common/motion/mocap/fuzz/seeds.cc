// mocap_fuzz_seeds FOLDER: small motion files of every kind to begin with.
#include <filesystem>
#include <fstream>
#include <iostream>

#include "common/motion/mocap/test/c3d_bytes.h"

namespace {

using namespace mimesis::mocap;

const std::string kBvh =
    "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\n"
    "CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation\n"
    "JOINT a\n{\nOFFSET 1 2 3\nCHANNELS 6 Xposition Yposition Zposition Yrotation Zrotation "
    "Xrotation\nEnd Site\n{\nOFFSET 0 -4 0\n}\n}\n}\nMOTION\nFrames: 2\nFrame Time: .0083333\n"
    "1 2 3 0 0 90 1 2 3 0 0 0\n1 2 3 0 30 0 1 2 9 20 40 -60\n";
const std::string kAsf =
    "# t\n:units\nlength 0.45\nangle deg\n:root\norder TX TY TZ RX RY RZ\naxis XYZ\n"
    "position 0 0 0\norientation 0 0 0\n:bonedata\nbegin\nid 1\nname hip\ndirection 1 0 0\n"
    "length 3\naxis 0 0 20 XYZ\nend\nbegin\nname leg\ndirection 0 -1 0\nlength 5\n"
    "axis 20 0 90 XYZ\ndof rx rz\nlimits (-1 2)\n(-7 7)\nend\n:hierarchy\nbegin\nroot hip\n"
    "hip leg\nend\n";
const std::string kAmc =
    "#!x\n:FULLY-SPECIFIED\n:DEGREES\n1\nroot 1 2 3 4 5 6\nleg 7 8\n2\nroot 1 2 3 4 5 6\nleg 7 8\n";

std::string c3d(C3dProcessor processor, bool real) {
  C3dBytes c;
  c.processor = processor;
  c.real = real;
  c.group(1, "POINT");
  c.group(2, "ANALOG");
  c.group(3, "TRIAL");
  c.words_of(1, "USED", {2});
  c.words_of(1, "FRAMES", {3});
  c.words_of(1, "DATA_START", {4});
  c.reals_of(1, "RATE", {50.0});
  c.reals_of(1, "SCALE", {real ? -0.5 : 0.5});
  c.reals_of(1, "LONG_FRAMES", {3.0});
  c.texts_of(1, "LABELS", {"A", "B"}, 4);
  c.texts_of(1, "UNITS", {"mm"}, 4);
  c.words_of(2, "USED", {3});
  c.reals_of(2, "RATE", {100.0});
  c.reals_of(2, "SCALE", {1.0, 2.0, 3.0});
  c.words_of(2, "OFFSET", {1, 2, 3});
  c.texts_of(2, "FORMAT", {"UNSIGNED"}, 8);
  c.words_of(3, "ACTUAL_START_FIELD", {5, 0});
  c.words_of(3, "ACTUAL_END_FIELD", {7, 0});
  for (int i = 0; i < 3 * 14; ++i) c.number(c.data, i % 8 == 3 ? 0 : i);
  return c.file();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: mocap_fuzz_seeds FOLDER\n";
    return 2;
  }
  const std::filesystem::path folder(argv[1]);
  std::filesystem::create_directories(folder);
  int n = 0;
  const auto put = [&](char kind, const std::string& file) {
    std::ofstream(folder / ("seed" + std::to_string(n++)), std::ios::binary) << kind << file;
  };
  put(0, kBvh);
  put(1, kAsf);
  put(1, kAsf + '\0' + kAmc);
  for (const C3dProcessor processor :
       {C3dProcessor::intel, C3dProcessor::dec, C3dProcessor::mips}) {
    for (const bool real : {false, true}) put(2, c3d(processor, real));
  }
  return 0;
}
