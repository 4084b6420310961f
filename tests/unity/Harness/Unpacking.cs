// What the package unpacks: zstd frames and KTX2 levels.
using System;
using System.IO;
using StereoCell.Editor;

static class Unpacking
{
    // Each frame on stdin has its bytes, its size unpacked, and itself. Each on stdout is 0 and the bytes, or 1.
    public static void Unpack()
    {
        using (var input = new BinaryReader(Console.OpenStandardInput()))
        using (var output = new BinaryWriter(Console.OpenStandardOutput()))
        {
            var count = input.ReadInt32();
            for (var i = 0; i < count; i++)
            {
                var length = input.ReadInt32();
                var size = input.ReadInt32();
                var frame = input.ReadBytes(length);
                try
                {
                    var found = Zstd.Unpack(frame, 0, length, size);
                    output.Write((byte)0);
                    output.Write(found);
                }
                catch (InvalidDataException)
                {
                    output.Write((byte)1);
                }
            }
        }
    }

    public static void Level(string path, int level)
    {
        var found = new Ktx2(File.ReadAllBytes(path), level);
        using (var output = Console.OpenStandardOutput()) output.Write(found.Texels, 0, found.Texels.Length);
    }

    /// <summary>All slices of a file of voxels, as texels.</summary>
    public static void Voxels(string path)
    {
        using (var file = new StereoCell.VolumeFile(File.OpenRead(path)))
        using (var output = Console.OpenStandardOutput())
        {
            var slice = new byte[file.Width * file.Height * StereoCell.VolumeFile.ComponentsOf(file.Channels)];
            for (var i = 0; i < file.Depth; i++)
            {
                file.ReadSlice(slice);
                output.Write(slice, 0, slice.Length);
            }
        }
    }
}
