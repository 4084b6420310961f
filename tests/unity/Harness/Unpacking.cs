// Unpacks zstd frames, KTX2 levels and voxel files with the package's code.
using System;
using System.IO;
using StereoCell.Editor;

static class Unpacking
{
    // Standard input has the number of frames, then for each frame its length, its unpacked size and its bytes. Standard
    // output has for each frame the byte 0 and the unpacked bytes, or the byte 1 if the frame is refused.
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

    /// <summary>Print all slices of a voxel file as texels.</summary>
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
